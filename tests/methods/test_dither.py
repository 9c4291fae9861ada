"""The dither of `final`: its noise, values that it does not change, and its effect on a dark
gradient."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.screens import CAMERA, panel
from tests.tolerance import assert_close
from vkbloom import Frames, Pyramid, Renderer, Scene, Separable, Settings, UnrealBloom, reference
from vkbloom._scene.textures import Texture

Array = NDArray[Any]

# Halves every value, exactly: what an odd one rounds to is the noise's choice.
HALVED = Separable(bloom=False, exposure=-1.0, dither=True)


def flat(size: tuple[int, int], level: int) -> NDArray[np.uint8]:
    return np.full((size[1], size[0], 4), level, np.uint8)


def final(renderer: Renderer, image: Array, settings: Settings) -> Array:
    return renderer.apply(image, settings, framebuffers=("final",))["final"]


def mixed(place: int, row: int, seed: int) -> list[int]:
    """Return the three numbers of pcg3d, computed with Python's integers."""
    x, y, z = (number * 1664525 + 1013904223 & 0xFFFFFFFF for number in (place, row, seed))
    for shift in (16, 32):
        x = x + y * z & 0xFFFFFFFF
        y = y + z * x & 0xFFFFFFFF
        z = z + x * y & 0xFFFFFFFF
        x, y, z = x ^ x >> shift, y ^ y >> shift, z ^ z >> shift
    return [x, y, z]


# The noise


@pytest.mark.parametrize("seed", [0, 1, 65535])
def test_the_noise_is_the_hash_of_place_and_seed(renderer: Renderer, seed: int) -> None:
    size = (37, 21)
    shown = final(renderer, flat(size, 101), HALVED.replace(dither_seed=seed))
    expected = np.empty((size[1], size[0], 3))
    for y, x in np.ndindex(expected.shape[:2]):
        noise = [((number >> 20) + 0.5) / 4096 for number in mixed(x, y, seed)]
        expected[y, x] = np.floor(50.5 + np.array(noise))
    np.testing.assert_array_equal(shown[..., :3], expected)
    assert (shown[..., 3] == 101).all()


# What it leaves alone


def test_levels_of_8_bits_stay(renderer: Renderer) -> None:
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(4, axis=2)
    for image in (ramp, np.tile(ramp, (8, 8, 1))):
        shown = final(renderer, image, Separable(bloom=False, dither=True))
        np.testing.assert_array_equal(shown, image)


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_floats_have_no_dither(renderer: Renderer, dtype: str) -> None:
    image = np.random.default_rng(4).random((20, 30, 3)).astype(dtype)
    settings = Separable(tonemap="aces")
    frames = renderer.apply(image, settings)
    dithered = renderer.apply(image, settings.replace(dither=True, dither_seed=7))
    # Not even a pass runs.
    assert not dithered.timings
    np.testing.assert_array_equal(dithered["final"], frames["final"])


def test_without_dither_the_seed_changes_nothing(renderer: Renderer) -> None:
    image = flat((16, 16), 55)
    settings = Separable(exposure=-1.0)
    frames = renderer.apply(image, settings)
    again = renderer.apply(image, settings.replace(dither_seed=9))
    assert not again.timings
    np.testing.assert_array_equal(again["final"], frames["final"])


def test_only_the_last_pass_runs(renderer: Renderer, scene: Scene) -> None:
    frames = renderer.render(scene, Separable(), (64, 36))
    dithered = renderer.render(scene, Separable(dither=True), (64, 36))
    assert list(dithered.timings) == ["final"]
    for name in set(frames) - {"final"}:
        np.testing.assert_array_equal(dithered[name], frames[name], err_msg=name)
    assert np.abs(dithered["final"].astype(int) - frames["final"]).max() <= 1


# Dark gradients


def gradient(renderer: Renderer, settings: Settings) -> Frames:
    """Render a body that emits 0 to 6 / 255 from left to right, over 512 pixels."""
    size = (512, 64)
    levels = np.ones((1, 512, 4), np.float16)
    levels[..., :3] = np.linspace(0, 6 / 255, 512)[:, np.newaxis]
    light = Texture((levels,), mag_filter="nearest", min_filter="nearest")
    black = Texture((np.full((1, 1, 4), (0, 0, 0, 1), np.float16),))
    body = panel(size, black, light, radiance=(1.0, 1.0, 1.0))
    # No light from the lamp: the normal leads away from it.
    vertices = body.vertices.copy()
    vertices[:, 3:6] = 0.0
    scene = Scene(
        body=type(body)(vertices, body.indices, body.emission, body.texcoords, body.surfaces),
        camera=CAMERA,
    )
    return renderer.render(scene, settings, size, shading="deferred")


def test_a_dark_gradient_has_no_bands(renderer: Renderer) -> None:
    settings = Separable(bloom=False)
    plain = gradient(renderer, settings)
    dithered = gradient(renderer, settings.replace(dither=True))
    exact = plain["scene"][..., :3].astype(np.float64) * 255
    np.testing.assert_array_equal(dithered["scene"], plain["scene"])
    # Blocks of 16 x 64 pixels with three channels: the mean of their roundings strays by 4 sigma,
    # 0.5 / sqrt(3072) each, at the most; bands are off by half a level.
    errors = [
        (frames["final"][..., :3] - exact).reshape(64, 32, 16, 3).mean(axis=(0, 2, 3))
        for frames in (plain, dithered)
    ]
    assert np.abs(errors[0]).max() > 0.35
    assert np.abs(errors[1]).max() < 4 * 0.5 / math.sqrt(3072)
    expected = reference.composite(plain["scene"], None, settings.replace(dither=True), "uint8")
    # A value in float32 may fall on the other side of a level, once in a thousand.
    assert (dithered["final"] != np.rint(expected * 255)).mean() < 1e-3


# The reference


@pytest.mark.parametrize(
    "settings",
    [
        Separable(dither=True),
        Separable(dither=True, dither_seed=3, tonemap="aces", encoding="srgb", composite="screen"),
        Pyramid(dither=True, levels=3, intensity=0.5),
        UnrealBloom(dither=True),
        Separable(dither=True, bloom=False, tonemap="agx"),
    ],
)
@pytest.mark.parametrize("channels", [3, 4])
def test_the_reference_dithers_alike(renderer: Renderer, settings: Settings, channels: int) -> None:
    image = np.random.default_rng(8).integers(0, 256, (45, 60, channels), np.uint8)
    frames = renderer.apply(image, settings)
    expected = reference.apply(image, settings)["final"]
    levels = expected[..., :3] * 255
    np.testing.assert_allclose(levels, np.rint(levels), atol=1e-9)
    # The bloom is rounded on its way, which moves a value over the noise's threshold.
    assert_close("final", frames["final"], expected, 2.5 / 255)
    if settings.bloom:
        blurred = reference.composite(image, frames["bloom"], settings)
        assert (frames["final"] != np.rint(blurred * 255)).mean() < 1e-3
    else:
        assert (frames["final"] != np.rint(expected * 255)).mean() < 1e-3


# The command line
