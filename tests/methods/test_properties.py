"""Laws of all methods, on the device and in the reference, with generated pictures."""

from __future__ import annotations

from typing import Any

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import EXHAUSTIVE, by_turns, examples
from tests.methods.cases import METHODS
from tests.variants import VARIANTS, open_variant
from vkbloom import (
    DualKawase,
    FilamentBloom,
    Pyramid,
    Renderer,
    Separable,
    Settings,
    UrpBloom,
    reference,
    testing,
)
from vkbloom.testing import Probe

Image = NDArray[Any]
Array = NDArray[np.float64]

#: Of METHODS.
LINEAR = (
    *("tutorial", "fractional", "layers", "outline", "direct", "half-size", "direct-half-size"),
    *("pyramid", "pyramid-radius", "dual-kawase", "dual-kawase-deep"),
)
FLOATS = ("float16", "float32")
#: Allowed error of one value, relative to the largest. Half: four roundings of 2**-11.
ERRORS = {"float16": 2e-3, "float32": 1e-5, "float64": 1e-12}

few = hypothesis.settings(max_examples=examples(2), deadline=None)


def bloom_of(renderer: Renderer, image: Image, settings: Settings) -> Array:
    """Return the bloom of the device, or, of an image of doubles, that of the reference."""
    if image.dtype == np.float64:
        bloom: Array = reference.apply(image, settings)["bloom"]
    else:
        bloom = renderer.apply(image, settings, framebuffers="bloom")["bloom"].astype(np.float64)
    return bloom[..., :3]


def noise(height: int, width: int, seed: int) -> Image:
    """Multiples of 1/256 from 1/4 to 1: sums of two are exact in all floats."""
    levels = np.random.default_rng(seed).integers(64, 257, (height, width, 3))
    return (levels / 256).astype(np.float32)


sides = st.integers(1, 24)
seeds = st.integers(0, 2**32 - 1)
pictures = st.builds(noise, sides, sides, seeds)


# --- The laws of vkbloom.testing ---


@pytest.mark.parametrize("dtype", ERRORS)
@pytest.mark.parametrize("method", LINEAR)
@few
@hypothesis.given(size=st.tuples(sides, sides), seed=seeds)
def test_linear_blurs_obey_the_laws_of_filters(
    renderer: Renderer, method: str, dtype: str, size: tuple[int, int], seed: int
) -> None:
    def bloom(image: Image) -> Array:
        return bloom_of(renderer, image, METHODS[method])

    probe = Probe(size=size, dtype=dtype, seed=seed, rtol=ERRORS[dtype])
    gain = reference.gain(METHODS[method])
    testing.assert_laws(bloom, "superposition", "gain", "no_ringing", gain=gain, probe=probe)


# --- Exact laws ---


@pytest.mark.parametrize(("method", "dtype"), by_turns([*LINEAR, "threshold"], turns=FLOATS))
@few
@hypothesis.given(picture=pictures, power=st.integers(-3, 8))
def test_powers_of_two_scale_the_bloom_exactly(
    renderer: Renderer, method: str, dtype: str, picture: Image, power: int
) -> None:
    # Nothing of `noise` is lost in another float.
    image, factor = picture.astype(dtype), 2.0**power
    plain = scaled = METHODS.get(method, Separable(threshold=0.5))
    if plain.threshold is not None:
        scaled = plain.replace(threshold=plain.threshold * factor)
    # A power of two moves the exponent alone, so that every rounding stays what it was.
    assert_array_equal(
        bloom_of(renderer, image * np.asarray(factor, dtype), scaled),
        bloom_of(renderer, image, plain) * factor,
    )


# Random filters, forward and transposed: all that runs a filter follows from its taps.


#: Of the largest value, and of the product of both norms.
LIMIT = 1e-6


def random_filter(random: np.random.Generator) -> Settings:
    """Return linear settings: windows of any width, taps that are too far apart for one, cubics."""
    offset, levels = float(random.uniform(0, 6)), int(random.integers(1, 4))
    scale_x, scale_y, radius = (float(value) for value in random.uniform(0, 3, 3))
    spread = float(random.uniform(0, 1))
    size = (int(random.integers(4, 40)), int(random.integers(4, 40)))
    found: tuple[Settings, ...] = (
        DualKawase(levels=levels, offset=offset),
        Pyramid(levels=levels, scale_x=scale_x, scale_y=scale_y, radius=radius, bloom_size=size),
        UrpBloom(filter="kawase", scatter=spread, threshold=None, clamp=65504, format=None),
        UrpBloom(filter="dual", scatter=spread, threshold=None, clamp=65504, format=None),
        FilamentBloom(resolution=16 * levels, levels=levels, threshold=None, format=None),
    )
    return found[random.integers(len(found))]


@pytest.mark.parametrize("variant", VARIANTS)
def test_random_filters_and_their_transposes(variant: str) -> None:
    """A x is NumPy's, and <A x, y> = <x, A' y>."""
    random = np.random.default_rng(VARIANTS.index(variant))
    with open_variant(variant) as renderer:
        for number in range(700 if EXHAUSTIVE else 12):
            settings = random_filter(random)
            image = random.random((*random.integers(3, 48, 2), 3), dtype=np.float32)
            frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
            bloom = frames["bloom"][..., :3].astype(np.float64)
            message = f"{number}: {settings} of {image.shape}"
            expected = reference.apply(image, settings)["bloom"][..., :3]
            assert np.abs(bloom - expected).max() <= LIMIT * np.abs(expected).max(), message
            cotangents = random.standard_normal(frames["bloom"].shape).astype(np.float32)
            cotangents[..., 3] = 0  # the bloom's alpha is 1
            found = pullback({"bloom": cotangents})["image"].astype(np.float64)
            sides = (bloom * cotangents[..., :3]).sum(), (image * found).sum()
            scale = np.linalg.norm(bloom) * np.linalg.norm(cotangents)
            assert abs(sides[0] - sides[1]) <= LIMIT * scale, message
