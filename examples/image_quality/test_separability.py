"""A Gaussian blur in two passes is the Gaussian blur of the plane."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from skimage.filters import gaussian
from skimage.metrics import structural_similarity

import vkbloom
from vkbloom import testing

# Below 1 by the rounding of float32; a kernel that is 2 % wider already falls below it.
MIN_SIMILARITY = 0.99999
SIGMAS = (1.0, 2.5, 4.0)


def gaussian_blur(sigma: float, *, direct: bool = False) -> vkbloom.Separable:
    """Return a blur with a gain of 1, without a threshold."""
    weights = vkbloom.gaussian_weights(sigma)
    return vkbloom.Separable(weights=weights, blur_strength=1.0, direct=direct)


def similarity(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Return the mean SSIM of two HDR images; their brightest value counts as white."""
    white = float(max(one.max(), other.max()))
    return float(structural_similarity(one, other, channel_axis=2, data_range=white))


@pytest.mark.parametrize("sigma", SIGMAS)
def test_two_passes_equal_one(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32], sigma: float
) -> None:
    """N + N taps in two passes give what N x N taps give in one."""
    two = bloom_renderer.apply(picture, gaussian_blur(sigma))["bloom"]
    one = bloom_renderer.apply(picture, gaussian_blur(sigma, direct=True))["bloom"]
    assert similarity(two, one) >= MIN_SIMILARITY


@pytest.mark.parametrize("sigma", SIGMAS)
def test_against_scikit_image(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32], sigma: float
) -> None:
    """Another implementation of the same kernel gives the same picture."""
    ours = bloom_renderer.apply(picture, gaussian_blur(sigma))["bloom"][..., :3]
    reach = math.ceil(3 * sigma)  # of the kernel of gaussian_weights
    theirs = gaussian(picture, sigma, mode="nearest", truncate=reach / sigma, channel_axis=2)
    assert similarity(ours, theirs) >= MIN_SIMILARITY


def test_the_limit_is_not_too_low(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32]
) -> None:
    """A limit that a slightly wider kernel passes would test nothing."""
    right = bloom_renderer.apply(picture, gaussian_blur(2.5))["bloom"]
    wider = bloom_renderer.apply(picture, gaussian_blur(2.5 * 1.02))["bloom"]
    assert similarity(right, wider) < MIN_SIMILARITY


def test_the_point_spread_is_a_row_times_a_column(bloom_renderer: vkbloom.Renderer) -> None:
    """SSIM compares two pictures; this law holds for a blur alone."""

    def blur(image: NDArray[np.float32]) -> NDArray[np.float32]:
        return bloom_renderer.apply(image, gaussian_blur(2.5))["bloom"]

    testing.assert_laws(blur, "separable")


def test_a_sum_of_two_blurs_is_not_separable(bloom_renderer: vkbloom.Renderer) -> None:
    """A core and a halo are two layers: no row times a column makes both."""
    halo = gaussian_blur(1.0).replace(layers=((1, 0.5), (4, 0.5)))
    with pytest.raises(AssertionError, match="a row times a column"):
        testing.assert_laws(lambda image: bloom_renderer.apply(image, halo)["bloom"], "separable")
