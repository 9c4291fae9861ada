"""Random filters, forward and transposed: all that runs a filter follows from its taps."""

from __future__ import annotations

import numpy as np
import pytest

import vkbloom
from tests.exhaustive import EXHAUSTIVE
from tests.methods.test_variants import VARIANTS, opened
from vkbloom import DualKawase, FilamentBloom, Pyramid, Settings, UrpBloom, reference

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
    with opened(variant) as renderer:
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
