"""Bloom of PlayCanvas' CameraFrame.

From playcanvas/engine 2.23: frame-pass-bloom.js and downsample.js @ 1f7213d06f78, 2.22.0-beta.20
@ 0aaef5e432c4.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._pyramid import downsample
from ._sampling import Array, halve_size, sample, size_of
from ._threshold import apply_mask, soften
from ._upsampling import combine, halvings, linear, tent

if TYPE_CHECKING:
    from vkbloom._methods.playcanvas import PlayCanvasBloom


def passes(source: BlurInput, settings: PlayCanvasBloom) -> dict[str, Array]:
    """Return the framebuffers.

    "half" is one bilinear tap at half of the frame's size. down_0 has half of that size, and each
    further level half of the one above, by 13 taps. The threshold is applied to down_0. up_k =
    down_k + tent(up_k+1); the bloom is up_0, bilinear.
    """
    level = halve_size(size_of(source.image))
    half = source.store(np.maximum(sample(source.image, level), 0))
    bright = _threshold(downsample(half, halve_size(level)), settings)
    first = source.store(apply_mask(bright, source.mask))
    downs = halvings(first, _level_count(level, settings), source.store, downsample)
    return {"half": half, **combine(downs, source, upsample=tent, last=linear)}


def gain(settings: PlayCanvasBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the number of levels."""
    first = float(_threshold(np.ones((1, 1, 1)), settings)[0, 0, 0])
    return first * _level_count(halve_size(size), settings)


def _level_count(half: tuple[int, int], settings: PlayCanvasBloom) -> int:
    return min(max(math.floor(math.log2(min(half))), 1), settings.blur_level)


def _threshold(rgb: Array, settings: PlayCanvasBloom) -> Array:
    return soften(rgb, settings.threshold or None, 0.5, added=1e-4, least=1e-4)
