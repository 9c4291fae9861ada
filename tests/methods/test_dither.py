"""The dither of `final`: its noise, values that it does not change, and its effect on a dark
gradient."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.images import picture
from tests.scene.parts import Texture
from tests.screens import CAMERA, panel
from tests.tolerance import assert_close
from vkbloom import Frames, Pyramid, Renderer, Scene, Separable, Settings, ThreeBloom, reference

# What it leaves alone


def test_levels_of_8_bits_stay(renderer: Renderer) -> None:
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(4, axis=2)
    for image in (ramp, np.tile(ramp, (8, 8, 1))):
        frames = renderer.apply(image, Separable(bloom=False, dither=True))
        np.testing.assert_array_equal(frames["final"], image)


@pytest.mark.parametrize("dtype", ["float16", "float32", "uint8"])
def test_floats_have_no_dither(renderer: Renderer, dtype: str) -> None:
    """Nor has an image without it, whatever the seed is."""
    image = picture(30, 20, 3, dtype, seed=4)
    settings = Separable(tonemap="aces")
    frames = renderer.apply(image, settings)
    dithered = renderer.apply(image, settings.replace(dither=dtype != "uint8", dither_seed=7))
    # Not even a pass runs.
    assert not dithered.timings
    np.testing.assert_array_equal(dithered["final"], frames["final"])


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


@pytest.mark.parametrize(
    "settings",
    [
        Separable(dither=True),
        Separable(
            dither=True, dither_seed=65535, tonemap="aces", encoding="srgb", composite="screen"
        ),
        Pyramid(dither=True, levels=3, intensity=0.5),
        ThreeBloom(dither=True),
        Separable(dither=True, bloom=False, tonemap="agx"),
        # It halves every value, exactly: what an odd one rounds to is the noise's choice.
        Separable(dither=True, dither_seed=1, bloom=False, exposure=-1.0),
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
