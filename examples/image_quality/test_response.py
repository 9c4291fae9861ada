"""Parameters act as their formulas say."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from vkbloom import testing

WEIGHTS = vkbloom.gaussian_weights(1.5)
BLUR = vkbloom.Separable(weights=WEIGHTS, blur_strength=1.0)
Image = NDArray[np.float32]


def of_settings(renderer: vkbloom.Renderer, settings: vkbloom.Settings) -> Callable[[Image], Image]:
    """Return the bloom of settings as a function of the image."""
    return lambda image: renderer.apply(image, settings)["bloom"]


def test_the_width_is_proportional_to_blur_scale(bloom_renderer: vkbloom.Renderer) -> None:
    """The variance of the kernel is 2 sum i^2 w_i; a step of s pixels multiplies sigma by s."""
    sigma = math.sqrt(2 * sum(i * i * weight for i, weight in enumerate(WEIGHTS)))
    for scale in (1.0, 2.0, 3.0):
        bloom = of_settings(bloom_renderer, BLUR.replace(blur_scale=scale))
        profile = testing.point_spread(bloom)[:, :, 0].sum(axis=0)
        distance = np.arange(len(profile)) - len(profile) // 2
        assert np.isclose(np.sqrt(profile @ distance**2 / profile.sum()), scale * sigma, rtol=1e-4)


def test_the_gain_follows_from_blur_strength(bloom_renderer: vkbloom.Renderer) -> None:
    """One direction multiplies light by w0 + strength * 2 sum w_i, and there are two."""
    for strength in (0.0, 0.5, 1.0, 2.0):
        bloom = of_settings(bloom_renderer, BLUR.replace(blur_strength=strength))
        gain = (WEIGHTS[0] + strength * 2 * sum(WEIGHTS[1:])) ** 2
        testing.assert_laws(bloom, "gain", gain=gain, size=(64, 64))


def test_intensity_is_linear(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32]
) -> None:
    """Twice the intensity adds twice the light."""
    intensities = np.array([0.25, 0.5, 1.0, 2.0])
    added = [
        bloom_renderer.apply(picture, BLUR.replace(intensity=value))["final"].sum(dtype=float)
        - picture.sum(dtype=float)
        for value in intensities
    ]
    np.testing.assert_allclose(added, intensities * added[-1] / 2, rtol=1e-4)


@pytest.mark.parametrize("knee", [0.0, 0.5, 1.0])
def test_the_threshold_curve(bloom_renderer: vkbloom.Renderer, knee: float) -> None:
    """Grey steps around the threshold, held to the curve that is documented."""
    threshold = 0.75
    steps = np.linspace(0, 2, 65, dtype=np.float32)
    image = np.repeat(steps[np.newaxis, :, np.newaxis], 3, axis=2)
    settings = BLUR.replace(threshold=threshold, knee=knee)
    glow = bloom_renderer.apply(image, settings)["glow"][0, :, 0]
    if knee == 0:
        # The luminance of a grey has the rounding of three products: the step at the threshold
        # itself may fall on either side.
        expected = np.where(steps > threshold, steps, 0)
        at = steps != threshold
        glow, expected = glow[at], expected[at]
    else:
        width = threshold * knee
        soft = np.clip(steps - threshold + width, 0, 2 * width) ** 2 / (4 * width + 1e-5)
        expected = np.maximum(soft, steps - threshold)
    np.testing.assert_allclose(glow, expected, rtol=1e-5, atol=1e-6)


def test_exposure_is_in_stops(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32]
) -> None:
    """One stop doubles the linear picture."""
    plain = bloom_renderer.apply(picture, BLUR)["final"]
    for stops in (-1.5, 1.0):
        final = bloom_renderer.apply(picture, BLUR.replace(exposure=stops))["final"]
        np.testing.assert_allclose(final, plain * 2**stops, rtol=1e-5)
