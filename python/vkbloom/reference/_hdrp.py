"""Bloom of Unity's High Definition Render Pipeline without a threshold.

From Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.high-definition/Runtime:
PostProcessing/Shaders/BloomPrefilter.compute @ 2309d2c2fde8, BloomBlur.compute and
BloomUpsample.compute @ 0e4ca4d79b2c, RenderPipeline/HDRenderPipeline.PostProcess.cs @ 0148835ea9ba.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from vkbloom._formats import LUMINANCE_7_DIGITS

from ._image import BlurInput, Storage
from ._sampling import Array, read_rows, sample, size_of, weighted_mean
from ._tape import contiguous
from ._threshold import apply_mask, firefly_weight, luminance
from ._upsampling import combine, cubic, cubic_rows, mix

if TYPE_CHECKING:
    from vkbloom._methods.unity import HdrpBloom

# (x, y) in texels of the frame.
_PREFILTER_TAPS = ((0.0, 0.0), (0.9, -0.4), (-0.9, 0.4), (0.4, 0.9), (-0.4, -0.9))
_LUMINANCE = np.array(LUMINANCE_7_DIGITS)
_RADIUS = 4
_KERNEL = [math.comb(2 * _RADIUS, i) / 4**_RADIUS for i in range(2 * _RADIUS + 1)]


def passes(source: BlurInput, settings: HdrpBloom) -> dict[str, Array]:
    """Return the framebuffers.

    Level k has the size of the frame / 2^(k + 1), rounded, ties to even. A negative anamorphism a
    multiplies its width by 1 + a / 2, a positive one its height by 1 - a / 2. Five taps of the
    frame, weighted by 1 / (1 + luminance), are stored at the size of down_0; down_0 is this image,
    blurred. Each further level is the one above it, read bilinearly at positions one pixel of the
    level apart, and blurred. The blur is the binomial of order 8 along each axis. up_k mixes the
    level with the smaller one, enlarged by the cubic B-spline or bilinearly, by the scatter. The
    bloom is the cubic B-spline of up_0.

    The borders differ. Before its first pixel, down_0 reads its pixels n mod 2. Beyond the last
    pixel, all levels read the last sample. In up_k, no position is beyond the middle of the last
    two texels, and no tap of the cubic filter beyond 1 - 1 / size of the larger level.
    """
    width, height = size_of(source.image)
    count = min(max(math.floor(math.log2(max(width, height)) - 2), 1), 16)
    reduced_width = width * (1 + min(settings.anamorphism, 0) / 2)
    reduced_height = height * (1 - max(settings.anamorphism, 0) / 2)
    sizes = [
        (max(1, round(reduced_width / 2 ** (k + 1))), max(1, round(reduced_height / 2 ** (k + 1))))
        for k in range(count)
    ]
    reduced = source.store(apply_mask(_prefilter(source.image, sizes[0]), source.mask))
    downs = [_along_both(reduced, sizes[0], _blur_rows, source.store)]
    for level in sizes[1:]:
        downs.append(_along_both(downs[-1], level, _shrink_rows, source.store))
    is_cubic = settings.high_quality_filtering and width >= 800 and height >= 450
    rows = _cubic_rows if is_cubic else _linear_rows
    shares = mix(0.05 + (0.95 - 0.05) * settings.scatter, count)
    up = partial(_along_both, rows=rows)
    return combine(downs, source, shares, upsample=up, last=cubic)


def gain(settings: HdrpBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, since no filter and no mix changes it."""
    return 1.0


def _prefilter(image: Array, size: tuple[int, int]) -> Array:
    taps = [sample(image, size, [(x, 1.0)], [(y, 1.0)]) for x, y in _PREFILTER_TAPS]
    return weighted_mean((firefly_weight(luminance(tap, _LUMINANCE)), tap) for tap in taps)


def _along_both(
    image: Array,
    size: tuple[int, int],
    rows: Callable[[Array, int], Array],
    store: Storage | None = None,
) -> Array:
    """Apply a filter of rows along x, then along y; each result is stored if `store` is given."""
    horizontal = rows(image.swapaxes(0, 1), size[0]).swapaxes(0, 1)
    both = rows(horizontal if store is None else store(horizontal), size[1])
    return contiguous(both) if store is None else store(both)


def _convolve(rows: Array, count: int) -> Array:
    """Apply the binomial to rows that start _RADIUS rows before the result."""
    total = np.zeros((count, *rows.shape[1:]))
    for i, weight in enumerate(_KERNEL):
        total += weight * rows[i : i + count]
    return total


def _blur_rows(image: Array, count: int) -> Array:
    indices = np.arange(-_RADIUS, count + _RADIUS)
    texels = np.minimum(np.where(indices < 0, indices % 2, indices), count - 1)
    return _convolve(image[texels], count)


def _shrink_rows(image: Array, count: int) -> Array:
    indices = np.minimum(np.arange(-_RADIUS, count + _RADIUS), count - 1)
    return _convolve(read_rows(image, (indices + 0.5) * image.shape[0] / count - 0.5), count)


def _up_positions(length: int, count: int) -> Array:
    """Return the positions of the larger level's pixels, in texels of the smaller one."""
    return np.minimum((np.arange(count) + 0.5) * length / count - 0.5, length - 1.5)


def _linear_rows(image: Array, count: int) -> Array:
    return read_rows(image, _up_positions(image.shape[0], count))


def _cubic_rows(image: Array, count: int) -> Array:
    """Sample the cubic B-spline with no tap beyond 1 - 1 / count."""
    length = image.shape[0]
    return cubic_rows(image, _up_positions(length, count), (1 - 1 / count) * length - 0.5)
