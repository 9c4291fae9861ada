"""Unreal's standard bloom as blurs of levels, against its formula, and where it is a transform."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom import Convolution, Renderer, UnrealBloom, reference

SINGLE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
#: The largest errors as shares of the largest value: of a lit pixel, which shows where Gaussians
#: are cut off, and of pictures.
PIXEL, PICTURE = 1.5e-4, 6e-5
#: Settings, sizes, and the limit of a lit pixel. The deviations of the Gaussians are from 0.1 to
#: 500 pixels.
CASES = {
    "levels of odd sides": (UnrealBloom(size_scale=16.0), (331, 187), PIXEL),
    "even": (UnrealBloom(size_scale=20.0), (256, 144), PIXEL),
    "tall": (UnrealBloom(size_scale=30.0), (91, 203), PIXEL),
    "small": (UnrealBloom(), (46, 35), PICTURE),
    # 0.3 times 40 / 3 is 4, whose threefold is just an integer.
    "radius": (UnrealBloom(size_scale=20.0), (400, 120), PIXEL),
    "one row": (UnrealBloom(size_scale=12.0), (203, 1), PIXEL),
    "tints": (
        UnrealBloom(size_scale=12.0, tints=(0.5, -0.1, 0.0, 0.0, 0.2, -0.05)),
        (160, 99),
        PIXEL,
    ),
    "equal sizes": (UnrealBloom(size_scale=8.0, sizes=(1, 30, 30, 30, 64, 64)), (120, 67), PICTURE),
    "points": (UnrealBloom(size_scale=0.0), (20, 11), 1e-6),
    "smaller buffers": (UnrealBloom(size_scale=20.0, bloom_scale=0.6), (331, 187), PIXEL),
    "narrow buffers": (UnrealBloom(size_scale=10.0, bloom_size=(101, 150)), (331, 187), PIXEL),
    # Its cut is 1e-2 of its largest value, and it is too long for a blur at the frame's size.
    "one large Gaussian": (UnrealBloom(size_scale=16.0, tints=SINGLE), (120, 67), 1e-5),
}
TRANSFORMED = {"one large Gaussian"}


def pictures(width: int, height: int) -> NDArray[np.float32]:
    """Return an image of three channels: noise, a lit pixel, and steps with a lit corner."""
    image = np.zeros((height, width, 3), np.float32)
    image[..., 0] = np.random.default_rng(1).random((height, width))
    image[height // 2, width // 3, 1] = 100
    image[..., width // 2 :, 2] = 1
    image[: height // 3, :, 2] *= 3
    image[0, 0, 2] = 100
    return image


@pytest.mark.parametrize("name", CASES)
def test_a_bloom_is_its_formula(renderer: Renderer, name: str) -> None:
    """Each channel by itself, relative to its largest value."""
    settings, size, limit = CASES[name]
    image = pictures(*size)
    settings = settings.replace(format="rgba32float")
    bloom = renderer.apply(image, settings, framebuffers=("bloom",))["bloom"][..., :3]
    expected = reference.apply(image, settings)["bloom"][..., :3]
    error = np.abs(bloom - expected).max(axis=(0, 1)) / np.abs(expected).max(axis=(0, 1))
    assert (error <= [min(limit, PICTURE), limit, min(limit, PICTURE)]).all(), error
    ran = {one.name for one in renderer.plan(image, settings).passes}
    assert ("kernel" in ran) == (name in TRANSFORMED)


def test_framebuffers(renderer: Renderer) -> None:
    """They are the same, whether the bloom is a transform or not."""
    image = pictures(24, 17)
    for tints in (SINGLE, UnrealBloom().tints):
        frames = renderer.apply(image, UnrealBloom(size_scale=64.0, tints=tints))
        assert list(frames) == ["glow", "bloom", "final"]
    assert "kernel" in renderer.apply(image, Convolution(np.ones((3, 3))))


@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_levels_are_floats(renderer: Renderer, dtype: str) -> None:
    """Only the bloom is rounded to the format, not the levels."""
    image = (pictures(120, 67) * (255 if dtype == "uint8" else 1)).clip(0, 255).astype(dtype)
    settings = UnrealBloom(size_scale=16.0)
    bloom = renderer.apply(image, settings)["bloom"].astype(np.float64)
    exact = renderer.apply(image, settings.replace(format="rgba32float"))["bloom"]
    if dtype == "uint8":
        assert np.abs(bloom / 255 - exact.clip(0, 1)).max() <= 0.51 / 255
    else:
        assert (np.abs(bloom - exact) <= 2.0**-11 * np.abs(exact) + 2.0**-25).all()
