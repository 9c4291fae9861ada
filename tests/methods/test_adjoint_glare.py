"""Derivatives by passes on the device, of glare whose samples are not on a grid."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.images import random_image
from tests.methods.test_adjoint_passes import check
from vkbloom import BlenderGlare, Ghosts, Halo, Pyramid, Renderer, reference
from vkbloom._gradients.passes import DeviceGradients
from vkbloom._renderer.sources import Inputs

VARIANTS = ("fragment", "cpu", "gpu")
#: Sides that are odd and even, one pixel, and less than a sample.
SIDES = (1, 2, 3, 8, 13, 24, 31)
#: Where a radius or a distance of colours is an integer number of texels, a halo's pixel may sample
#: the centre but for rounding, from which red and blue are moved in any direction.
RADII = (0.001, 0.113, 0.2571, 0.413, 1.037, 3.011)
SCALES = (0.0, 0.001, -0.1, 0.5, -1.0, 1.0, 1.5, -3.0, 16.0)


def flare(random: np.random.Generator) -> Halo | Ghosts:
    """Any halo, or any ghosts with an aberration."""
    given: dict[str, Any] = {
        "aberration": float(random.choice([0.01, 0.05, 0.2, 0.5])),
        "halvings": int(random.integers(0, 2)),
        "threshold": float(random.choice([0, 0.3])),
        "maximum": float(random.choice([0.5, 100])),
        "radius": float(random.choice(RADII)),
    }
    if random.random() < 0.5:
        given["aberration"] *= random.integers(0, 2)
        return Halo(width=float(random.choice([0.05, 0.5, 4])), **given)
    return Ghosts(
        scales=tuple(map(float, random.choice(SCALES, 3))),
        tints=((1.0, 0.5, 0.2),),
        falloff=float(random.choice([0, 1, 2.5])),
        vignette=float(random.choice([0, 0.4])),
        **given,
    )


def both(
    renderer: Renderer, settings: Any, image: Any, name: str = "final"
) -> tuple[Any, Any, dict[str, Any]]:
    """The framebuffer, the derivative on the device by the image, and the cotangent."""
    frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    shape = frames[name].shape
    cotangents = {name: np.random.default_rng(5).standard_normal(shape).astype(np.float32)}
    found = pullback(cotangents)
    assert isinstance(found, DeviceGradients)
    assert np.array_equal(pullback(cotangents)["image"], found["image"])
    return frames[name], found, cotangents


def check_adjoint(frame: Any, found: Any, image: Any, cotangent: Any) -> None:
    """Where A is linear, (A x, y) is (x, A' y)."""
    channels = image.shape[2]
    forward = frame.astype(np.float64)[..., :channels] * cotangent[..., :channels]
    backward = found["image"].astype(np.float64) * image
    assert abs(forward.sum() - backward.sum()) < 1e-6 * np.abs(backward).sum()


def sums_of(renderer: Renderer, image: Any, settings: Any) -> Any:
    """The passes that gather samples of ghosts and halos."""
    source = Inputs(image).source((image,))
    floats = settings.replace(format="rgba32float")
    plan = renderer._core.adjoint(source, floats, ("final",), False)
    return plan and [name for _, name, *_ in plan.passes if name.startswith("adjoint_moved")]


#: Texels near the centre are sampled by more pixels than an invocation can read, in part by all.
LARGE = (
    (Halo(aberration=0.02), (270, 480), 2),
    (Halo(width=4, radius=0.3), (270, 481), 2),
    (Halo(), (9, 140), 1),
    (Ghosts(scales=(0.001, -0.6), aberration=0.01), (231, 350), 4),
)


@pytest.mark.parametrize(("stage", "size", "count"), LARGE)
def test_many_pixels_are_added_up_in_groups(
    renderer: Renderer, stage: Any, size: tuple[int, int], count: int
) -> None:
    settings = Pyramid(levels=1, glare=(dataclasses.replace(stage, halvings=0),))
    image = random_image(*size, channels=3, seed=1).astype(np.float32)
    assert len(sums_of(renderer, image, settings)) == count
    frame, found, cotangents = both(renderer, settings, image, stage.stage)
    check_adjoint(frame, found, image, cotangents[stage.stage])


def test_what_needs_too_many_sums_comes_from_the_reference(renderer: Renderer) -> None:
    stage = Ghosts(scales=(0.001,), aberration=0.5, halvings=0)
    settings = Pyramid(levels=1, glare=(stage,))
    image = random_image(100, 400, channels=3, seed=1).astype(np.float32)
    assert sums_of(renderer, image, settings) is None
    cotangents = {"final": image}
    found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
    assert not isinstance(found, DeviceGradients)
    check(found, reference.vjp(image, settings)[1](cotangents), "image")


#: Inside of the image, at its edges, outside, and far away.
SUNS = (0.5, 0.3, 0.123, 0.0, 1.0, -0.4, 1.7, -16.0)


def blender(random: np.random.Generator, type: Any) -> BlenderGlare:
    given: dict[str, Any] = {
        "quality": str(random.choice(["high", "medium", "low"])),
        "threshold": 0.3 if random.random() < 0.5 else None,
        "alpha": str(random.choice(["keep", "blur"])),
    }
    if type == "simple_star":
        given["iterations"] = int(random.integers(2, 6))
        given["fade"] = float(random.choice([0.75, 0.9, 1]))
        given["diagonal"] = bool(random.integers(2))
    else:
        given["size"] = float(random.choice([0.1, 0.5, 1]))
        # With more, the places of the few samples have larger roundings, in the frames too.
        given["jitter"] = float(random.choice([0, 0, 0.3, 0.7, 1]))
        given["sun_position"] = tuple(map(float, random.choice(SUNS, 2)))
    return BlenderGlare(type=type, **given)


def of_flare(random: np.random.Generator) -> Pyramid:
    alpha: Any = "blur" if random.random() < 0.3 else "keep"
    return Pyramid(levels=1, glare=(flare(random),), alpha=alpha)


@pytest.mark.usefixtures("software")
@pytest.mark.parametrize("kind", ["flare", "simple_star", "sun_beams"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_glare_is_transposed(monkeypatch: pytest.MonkeyPatch, variant: str, kind: str) -> None:
    monkeypatch.setenv("VKBLOOM_VARIANT", variant)
    random = np.random.default_rng(VARIANTS.index(variant))
    with Renderer("software", validation=True) as renderer:
        for seed in range(10):
            settings: Any = of_flare(random) if kind == "flare" else blender(random, kind)
            height, width = map(int, random.choice(SIDES, 2))
            channels = 4 if settings.alpha == "blur" else 3
            image = random_image(height, width, channels=channels, seed=seed).astype(np.float32)
            name = settings.glare[0].stage if kind == "flare" else "bloom"
            _, found, cotangents = both(renderer, settings, image, name)
            check(found, reference.vjp(image, settings)[1](cotangents), "image")


def test_many_pixels_are_behind_a_texel_near_the_sun(renderer: Renderer) -> None:
    """They are added up in groups of rows."""
    settings = BlenderGlare(type="sun_beams", threshold=None, size=1.0, sun_position=(0.4, 0.3))
    image = random_image(500, 251, channels=3, seed=1).astype(np.float32)
    source = Inputs(image).source((image,))
    floats = settings.replace(format="rgba32float")
    plan = renderer._core.adjoint(source, floats, ("final",), False)
    assert plan
    assert sum(name.startswith("adjoint_beams") for _, name, *_ in plan.passes) == 3
    frame, found, cotangents = both(renderer, settings, image, "bloom")
    check_adjoint(frame, found, image, cotangents["bloom"])
