"""Bloom of Unity's High Definition Render Pipeline without a threshold.

From Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.high-definition/Runtime:
PostProcessing/Shaders/BloomPrefilter.compute @ 2309d2c2fde8, BloomBlur.compute and
BloomUpsample.compute @ 0e4ca4d79b2c, RenderPipeline/HDRenderPipeline.PostProcess.cs @ 0148835ea9ba.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from .image import Storage
from .sampling import Array, read_rows, sample
from .threshold import masked
from .upsampling import combine, cubic, spline_taps

__all__ = ["gain", "passes"]

# (x, y) in texels of the frame.
_PREFILTER_TAPS = ((0.0, 0.0), (0.9, -0.4), (-0.9, 0.4), (0.4, 0.9), (-0.4, -0.9))
_LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750])
_RADIUS = 4
_KERNEL = [math.comb(2 * _RADIUS, i) / 4**_RADIUS for i in range(2 * _RADIUS + 1)]


class HdrpSettings(Protocol):
    """What this blur reads of `vkbloom.HdrpBloom`."""

    @property
    def scatter(self) -> float: ...
    @property
    def high_quality_filtering(self) -> bool: ...
    @property
    def anamorphism(self) -> float: ...


def passes(
    glow: Array,
    settings: HdrpSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    Level k is the frame's size / 2^(k + 1), rounded, halves to even; an anamorphism a below 0
    multiplies the width by 1 + a / 2, one above 0 the height by 1 - a / 2. Five taps of the frame,
    weighted by 1 / (1 + luminance), go into an image of the size of down_0, which is that image
    blurred; each further level is the one above it, bilinear at positions one pixel of the level
    apart, blurred. The blur is the binomial of order 8 along each axis. On the way up the smaller
    level, by the cubic B-spline or bilinear, and the level are mixed by the scatter; the bloom is
    the cubic B-spline of up_0.

    The borders are not the same on all sides. Before the first pixel down_0 reads the first two in
    turn, n mod 2. Beyond the last pixel all levels read the last one's sample. On the way up no
    position lies beyond the middle between the last two texels, and no tap of the cubic filter
    beyond 1 - 1 / size of the larger level.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1, 3 or, with alpha, 4 channels.
    settings : vkbloom.HdrpBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies the prefiltered image.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    count = min(max(math.floor(math.log2(max(width, height)) - 2), 1), 16)
    across = width * (1 + min(settings.anamorphism, 0) / 2)
    down = height * (1 - max(settings.anamorphism, 0) / 2)
    sizes = [
        (max(1, round(across / 2 ** (k + 1))), max(1, round(down / 2 ** (k + 1))))
        for k in range(count)
    ]
    reduced = store(masked(_prefilter(glow, sizes[0]), mask))
    downs = [_along_both(reduced, sizes[0], _blur_rows, store)]
    for level in sizes[1:]:
        downs.append(_along_both(downs[-1], level, _shrink_rows, store))
    share = 0.05 + (0.95 - 0.05) * settings.scatter
    is_cubic = settings.high_quality_filtering and width >= 800 and height >= 450
    rows = _cubic_rows if is_cubic else _linear_rows
    return {
        **{f"down_{k}": down for k, down in enumerate(downs)},
        **combine(
            downs,
            size,
            store,
            own=[1 - share] * count,
            coarse=[share] * count,
            upsample=lambda image, larger: _along_both(image, larger, rows),
            last=cubic,
        ),
    }


def gain(settings: HdrpSettings) -> float:
    """Return what a flat image of 1 becomes: 1, for all filters and mixes keep it."""
    return 1.0


def _prefilter(image: Array, size: tuple[int, int]) -> Array:
    total, shares = np.zeros((size[1], size[0], image.shape[2])), np.zeros((size[1], size[0], 1))
    for x, y in _PREFILTER_TAPS:
        tap = sample(image, size, [(x, 1.0)], [(y, 1.0)])
        grey = tap if tap.shape[2] == 1 else (tap[..., :3] * _LUMINANCE).sum(axis=-1, keepdims=True)
        share = 1 / (1 + np.maximum(grey, 0))
        total += share * tap
        shares += share
    return total / shares


def _along_both(
    image: Array,
    size: tuple[int, int],
    rows: Callable[[Array, int], Array],
    store: Storage | None = None,
) -> Array:
    """Apply a filter of rows along x, then along y; `store` is between the two and at the end."""
    across = rows(image.swapaxes(0, 1), size[0]).swapaxes(0, 1)
    down = rows(across if store is None else store(across), size[1])
    return np.ascontiguousarray(down) if store is None else store(down)


def _convolve(rows: Array, count: int) -> Array:
    """Apply the binomial to rows of which the first is _RADIUS before the result's first."""
    total = np.zeros((count, *rows.shape[1:]))
    for i, weight in enumerate(_KERNEL):
        total += weight * rows[i : i + count]
    return total


def _blur_rows(image: Array, count: int) -> Array:
    places = np.arange(-_RADIUS, count + _RADIUS)
    texels = np.minimum(np.where(places < 0, places % 2, places), count - 1)
    return _convolve(image[texels], count)


def _shrink_rows(image: Array, count: int) -> Array:
    places = np.minimum(np.arange(-_RADIUS, count + _RADIUS), count - 1)
    return _convolve(read_rows(image, (places + 0.5) * image.shape[0] / count - 0.5), count)


def _up_positions(length: int, count: int) -> Array:
    """Return where the pixels of the larger level fall, in texels of the smaller one."""
    return np.minimum((np.arange(count) + 0.5) * length / count - 0.5, length - 1.5)


def _linear_rows(image: Array, count: int) -> Array:
    return read_rows(image, _up_positions(image.shape[0], count))


def _cubic_rows(image: Array, count: int) -> Array:
    """Read the cubic B-spline as two bilinear taps, neither beyond 1 - 1 / count."""
    length = image.shape[0]
    furthest = (1 - 1 / count) * length - 0.5
    total = np.zeros((count, *image.shape[1:]))
    for position, weight in spline_taps(_up_positions(length, count)):
        rows = read_rows(image, np.minimum(position, furthest))
        total += weight[:, np.newaxis, np.newaxis] * rows
    return total
