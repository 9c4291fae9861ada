"""Keijiro Takahashi's KinoBloom, version 2, high quality.

From keijiro/KinoBloom @ 0a04c43fa47d (2017), Assets/Kino/Bloom: Bloom.cs, Shader/Bloom.cginc.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Protocol

import numpy as np

from .image import Storage
from .sampling import Array, sample
from .threshold import brightest, masked, soften
from .upsampling import combine, tent

__all__ = ["gain", "passes"]


class KinoSettings(Protocol):
    """What this blur reads of `vkbloom.KinoBloom`."""

    @property
    def threshold(self) -> float | None: ...
    @property
    def knee(self) -> float: ...
    @property
    def radius(self) -> float: ...
    @property
    def anti_flicker(self) -> bool: ...


def passes(
    glow: Array,
    settings: KinoSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    With lg = log2(H) + radius - 8 there are N = clamp(trunc(lg), 1, 16) levels, and the tent's
    step is 0.5 + lg - trunc(lg). bright = the soft threshold of the median of five pixels;
    down_k = the mean of four taps one texel away; bloom = tent(up_0), the levels simply added.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
    settings : vkbloom.KinoBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies bright after the threshold.

    Returns
    -------
    dict of str to ndarray
        "bright", "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    count, step = _count_and_step(settings, height)
    framebuffers = {"bright": store(masked(_prefilter(glow, settings), mask))}
    image, downs = framebuffers["bright"], []
    for k in range(count):
        width, height = max(1, width // 2), max(1, height // 2)
        image = store(_box(image, (width, height), settings.anti_flicker and k == 0))
        framebuffers[f"down_{k}"] = image
        downs.append(image)
    up = partial(tent, x_step=step, y_step=step)
    ones = [1.0] * count
    return {
        **framebuffers,
        **combine(downs, size, store, own=ones, coarse=ones, upsample=up, last=up),
    }


def gain(settings: KinoSettings, size: tuple[int, int]) -> float:
    """Return what a flat image of 1 becomes: what passes the threshold, times the levels."""
    bright = _threshold(np.ones((1, 1, 1)), settings)
    return float(bright[0, 0, 0]) * _count_and_step(settings, size[1])[0]


def _count_and_step(settings: KinoSettings, height: int) -> tuple[int, float]:
    lg = math.log2(height) + settings.radius - 8
    return min(max(math.trunc(lg), 1), 16), 0.5 + lg - math.trunc(lg)


def _prefilter(image: Array, settings: KinoSettings) -> Array:
    kept = np.concatenate([np.minimum(image[..., :3], 65000), image[..., 3:]], axis=-1)
    padded = np.pad(kept, ((1, 1), (1, 1), (0, 0)), mode="edge")
    kept = padded[1:-1, 1:-1]
    if settings.anti_flicker:
        kept = np.median([kept, padded[1:-1, :-2], padded[1:-1, 2:]], axis=0)
        kept = np.median([kept, padded[:-2, 1:-1], padded[2:, 1:-1]], axis=0)
    return _threshold(kept, settings)


def _threshold(rgb: Array, settings: KinoSettings) -> Array:
    if settings.threshold is None:
        return rgb
    half_width = settings.threshold * settings.knee + 1e-5
    return soften(rgb, settings.threshold, half_width, 4 * half_width, 1e-5)


def _box(image: Array, size: tuple[int, int], firefly_filter: bool) -> Array:
    """Read the four diagonals one texel away, weighted by 1 / (1 + brightest channel) if asked."""
    total, shares = np.zeros((size[1], size[0], image.shape[2])), np.zeros((size[1], size[0], 1))
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            tap = sample(image, size, [(x, 1.0)], [(y, 1.0)])
            share = np.ones_like(shares)
            if firefly_filter:
                share /= 1 + np.maximum(brightest(tap), 0.0)
            total += share * tap
            shares += share
    return total / shares
