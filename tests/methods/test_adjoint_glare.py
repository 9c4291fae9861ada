"""Derivatives by passes on the device, of glare."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.images import random_image
from tests.methods.test_adjoint_passes import check
from vkbloom import BlenderGlare, Ghosts, Halo, Pyramid, Renderer, reference
from vkbloom._gradients.passes import DeviceGradients

VARIANTS = ("fragment", "cpu", "gpu")
#: Sides that are odd and even, one pixel, and less than a sample.
SIDES = (1, 2, 3, 8, 13, 24, 31)
SCALES = (0.0, 0.001, -0.1, 0.5, -1.0, 1.0, 1.5, -3.0, 16.0)


def scattered(stage: Any) -> Pyramid:
    return Pyramid(levels=1, glare=(stage,))


@pytest.mark.parametrize(
    "settings",
    [
        scattered(Halo()),
        scattered(Ghosts(scales=(0.001, 0.5), aberration=0.05)),
        BlenderGlare(type="sun_beams", threshold=None),
    ],
)
def test_samples_that_are_not_on_a_grid_come_from_the_reference(
    renderer: Renderer, settings: Any
) -> None:
    image = random_image(13, 24, channels=3, seed=1).astype(np.float32)
    cotangents = {"final": image}
    found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangents)
    assert not isinstance(found, DeviceGradients)
    check(found, reference.vjp(image, settings)[1](cotangents), "image")


def ghosts(random: np.random.Generator, alpha: Any) -> Pyramid:
    stage = Ghosts(
        scales=tuple(map(float, random.choice(SCALES, 3))),
        tints=((1.0, 0.5, 0.2),),
        falloff=float(random.choice([0, 1, 2.5])),
        vignette=float(random.choice([0, 0.4])),
        aberration=0.0,
        halvings=int(random.integers(0, 2)),
        threshold=float(random.choice([0, 0.3])),
        maximum=float(random.choice([0.5, 100])),
    )
    return Pyramid(levels=1, glare=(stage,), alpha=alpha)


def star(random: np.random.Generator, alpha: Any) -> BlenderGlare:
    quality: Any = str(random.choice(["high", "medium", "low"]))
    return BlenderGlare(
        type="simple_star",
        quality=quality,
        threshold=0.3 if random.random() < 0.5 else None,
        alpha=alpha,
        iterations=int(random.integers(2, 6)),
        fade=float(random.choice([0.75, 0.9, 1])),
        diagonal=bool(random.integers(2)),
    )


@pytest.mark.usefixtures("software")
@pytest.mark.parametrize(("settings_of", "name"), [(ghosts, "ghosts"), (star, "bloom")])
@pytest.mark.parametrize("variant", VARIANTS)
def test_glare_is_transposed(
    monkeypatch: pytest.MonkeyPatch, variant: str, settings_of: Any, name: str
) -> None:
    monkeypatch.setenv("VKBLOOM_VARIANT", variant)
    random = np.random.default_rng(VARIANTS.index(variant))
    with Renderer("software", validation=True) as renderer:
        for seed in range(6):
            alpha = str(random.choice(["keep", "blur"]))
            settings = settings_of(random, alpha)
            height, width = map(int, random.choice(SIDES, 2))
            channels = 4 if alpha == "blur" else 3
            image = random_image(height, width, channels=channels, seed=seed).astype(np.float32)
            frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
            shape = frames[name].shape
            cotangents = {name: np.random.default_rng(5).standard_normal(shape).astype(np.float32)}
            found = pullback(cotangents)
            assert isinstance(found, DeviceGradients)
            assert np.array_equal(pullback(cotangents)["image"], found["image"])
            check(found, reference.vjp(image, settings)[1](cotangents), "image")
