"""Unreal Engine's standard bloom, by its documentation.

The sizes, the tints and the threshold are those that Epic documents ("Bloom in Unreal Engine",
method Standard). The standard deviation is our reading of "diameter": a sixth of it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._sampling import Array, sample
from ._threshold import luminance, masked, with_alpha

if TYPE_CHECKING:
    from vkbloom._methods.unreal import UnrealBloom

__all__ = ["gain", "passes"]


def passes(source: BlurInput, settings: UnrealBloom) -> dict[str, Array]:
    """Return the framebuffers.

    "bright" is the frame times its luminance above the threshold, clamped to 0..1. down_k is a
    Gaussian of "bright" with a diameter of sizes[k] percent of the width times `size_scale`, and a
    sixth of it as the standard deviation. Beyond the borders are the outermost pixels. The bloom is
    the sum of the levels times their tints.
    """
    height, width, channels = source.image.shape
    bright = source.store(masked(_prefilter(source.image, settings), source.mask))
    framebuffers = {"bright": bright}
    total = np.zeros_like(bright)
    for k, (size, tint) in enumerate(zip(settings.sizes, settings.tints, strict=True)):
        taps = _taps(size / 100 * settings.size_scale * width / 6)
        horizontal = sample(bright, (width, height), x_taps=taps)
        level = source.store(sample(horizontal, (width, height), y_taps=taps))
        framebuffers[f"down_{k}"] = level
        total = total + with_alpha((tint,) * 3, channels) * level
    framebuffers["bloom"] = source.store.end(sample(total, source.size))
    return framebuffers


def gain(settings: UnrealBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the sum of the tints."""
    return float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0]) * sum(settings.tints)


def _prefilter(rgb: Array, settings: UnrealBloom) -> Array:
    if settings.threshold is None:
        return rgb
    return rgb * np.clip(luminance(rgb) - settings.threshold, 0, 1)


def _taps(deviation: float) -> list[tuple[float, float]]:
    """Return a normalized Gaussian up to three standard deviations, rounded up to pixels."""
    radius = math.ceil(3 * deviation)
    places = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (places / deviation) ** 2) if deviation else np.ones(1)
    weights /= weights.sum()
    return [(float(at), float(weight)) for at, weight in zip(places, weights, strict=True)]
