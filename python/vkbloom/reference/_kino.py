"""Keijiro Takahashi's KinoBloom, version 2, high quality.

From keijiro/KinoBloom @ 0a04c43fa47d (2017), Assets/Kino/Bloom: Bloom.cs, Shader/Bloom.cginc.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._sampling import Array, halve_size, sample, size_of, weighted_mean
from ._threshold import apply_mask, brightest, firefly_weight, soften
from ._upsampling import combine, halvings, tent

if TYPE_CHECKING:
    from vkbloom._methods.kino import KinoBloom


def passes(source: BlurInput, settings: KinoBloom) -> dict[str, Array]:
    """Return the framebuffers.

    With lg = log2(H) + radius - 8, there are N = clamp(trunc(lg), 1, 16) levels, and the step of
    the tent is 0.5 + lg - trunc(lg). bright is the median of five pixels after the soft threshold,
    down_k the mean of four taps one texel away, up_k = down_k + tent(up_k+1), and the bloom
    tent(up_0).
    """
    size = size_of(source.image)
    count, step = _count_and_step(settings, size[1])
    bright = source.store(apply_mask(_prefilter(source.image, settings), source.mask))
    reduce = _firefly_box if settings.anti_flicker else _box
    first = source.store(reduce(bright, halve_size(size)))
    downs = halvings(first, count, source.store, _box)
    up = partial(tent, x_step=step, y_step=step)
    ups = combine(downs, source, upsample=up, last=up)
    return {"bright": bright, **ups}


def gain(settings: KinoBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the result of the threshold, times the levels."""
    bright = _threshold(np.ones((1, 1, 1)), settings)
    return float(bright[0, 0, 0]) * _count_and_step(settings, size[1])[0]


def _count_and_step(settings: KinoBloom, height: int) -> tuple[int, float]:
    lg = math.log2(height) + settings.radius - 8
    return min(max(math.trunc(lg), 1), 16), 0.5 + lg - math.trunc(lg)


def _prefilter(image: Array, settings: KinoBloom) -> Array:
    clamped = np.concatenate([np.minimum(image[..., :3], 65000), image[..., 3:]], axis=-1)
    padded = np.pad(clamped, ((1, 1), (1, 1), (0, 0)), mode="edge")
    kept = padded[1:-1, 1:-1]
    if settings.anti_flicker:
        kept = _median(kept, padded[1:-1, :-2], padded[1:-1, 2:])
        kept = _median(kept, padded[:-2, 1:-1], padded[2:, 1:-1])
    return _threshold(kept, settings)


def _median(first: Array, second: Array, third: Array) -> Array:
    larger = np.minimum(np.maximum(first, second), third)
    median: Array = np.maximum(np.minimum(first, second), larger)
    return median


def _threshold(rgb: Array, settings: KinoBloom) -> Array:
    return soften(rgb, settings.threshold, settings.knee, wider=1e-5, least=1e-5)


def _taps(image: Array, size: tuple[int, int]) -> list[Array]:
    """Return the four diagonal taps one texel away."""
    return [sample(image, size, [(x, 1.0)], [(y, 1.0)]) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]


def _box(image: Array, size: tuple[int, int]) -> Array:
    return weighted_mean((1.0, tap) for tap in _taps(image, size))


def _firefly_box(image: Array, size: tuple[int, int]) -> Array:
    """Return the mean of taps, weighted by 1 / (1 + brightest channel)."""
    return weighted_mean((firefly_weight(brightest(tap)), tap) for tap in _taps(image, size))
