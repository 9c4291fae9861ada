"""Bloom of Unity's High Definition Render Pipeline without a threshold.

From Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.high-definition/Runtime:
PostProcessing/Shaders/BloomPrefilter.compute @ 2309d2c2fde8, BloomBlur.compute and
BloomUpsample.compute @ 0e4ca4d79b2c, RenderPipeline/HDRenderPipeline.PostProcess.cs @ 0148835ea9ba.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from .image import Storage
from .sampling import Array, sample
from .upsampling import combine, cubic, linear

__all__ = ["gain", "passes"]

# (x, y) in texels of the frame.
_PREFILTER_TAPS = ((0.0, 0.0), (0.9, -0.4), (-0.9, 0.4), (0.4, 0.9), (-0.4, -0.9))
_LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750])


class HdrpSettings(Protocol):
    """What this blur reads of `vkbloom.HdrpBloom`."""

    @property
    def scatter(self) -> float: ...
    @property
    def high_quality_filtering(self) -> bool: ...


def passes(
    glow: Array, settings: HdrpSettings, size: tuple[int, int], store: Storage
) -> dict[str, Array]:
    """Return the framebuffers.

    Level k is the frame's size / 2^(k + 1), rounded, halves to even. Five taps of the frame,
    weighted by 1 / (1 + luminance), go into an image of the size of down_0, which is that image
    blurred; each further level is the one above it, bilinear at positions one pixel of the level
    apart, blurred. The blur is the binomial of order 8 along each axis. On the way up the smaller
    level, by the cubic B-spline or bilinear, and the level are mixed by the scatter; the bloom is
    the cubic B-spline of up_0.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1 or 3 channels.
    settings : vkbloom.HdrpBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    count = min(max(math.floor(math.log2(max(width, height)) - 2), 1), 16)
    sizes = [
        (max(1, round(width / 2 ** (k + 1))), max(1, round(height / 2 ** (k + 1))))
        for k in range(count)
    ]
    image, downs = store(_prefilter(glow, sizes[0])), []
    for level in sizes:
        image = _blur(image, level, store)
        downs.append(image)
    share = 0.05 + (0.95 - 0.05) * settings.scatter
    is_cubic = settings.high_quality_filtering and width >= 800 and height >= 450
    return {
        **{f"down_{k}": down for k, down in enumerate(downs)},
        **combine(
            downs,
            size,
            store,
            own=[1 - share] * count,
            coarse=[share] * count,
            upsample=cubic if is_cubic else linear,
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
        grey = tap if tap.shape[2] == 1 else (tap * _LUMINANCE).sum(axis=-1, keepdims=True)
        share = 1 / (1 + np.maximum(grey, 0))
        total += share * tap
        shares += share
    return total / shares


def _blur(image: Array, size: tuple[int, int], store: Storage) -> Array:
    """Read 9 x 9 bilinear taps one pixel of the result apart, the columns first."""
    height, width, _ = image.shape
    weights = [math.comb(8, i) / 256 for i in range(9)]
    x_taps, y_taps = (
        [((i - 4) * ratio, weight) for i, weight in enumerate(weights)]
        for ratio in (width / size[0], height / size[1])
    )
    across = store(sample(image, (size[0], height), x_taps=x_taps))
    return store(sample(across, size, y_taps=y_taps))
