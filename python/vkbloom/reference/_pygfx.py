"""pygfx' PhysicalBasedBloomPass.

From pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput, finite
from ._pyramid import downsample, groups
from ._sampling import Array, halve_size, size_of, weighted_mean
from ._threshold import apply_mask, luminance
from ._upsampling import combine, halvings, linear, tent

if TYPE_CHECKING:
    from vkbloom._methods.pygfx import PygfxBloom


def passes(source: BlurInput, settings: PygfxBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 has half the size of the frame and each next level half of the one before, by 13 taps.
    With `karis_average`, down_0 is the mean of their five groups, weighted by 1 / (1 + luminance)
    only. up_k = down_k + tent(up_k+1), whose taps are `filter_radius` of the width apart along
    both axes; the bloom is up_0, bilinear. The levels are clamped to at least 0.
    """
    size = size_of(source.image)
    shrink = _average if settings.karis_average else downsample
    first = np.maximum(shrink(source.image, halve_size(size)), 0)
    downs = halvings(
        source.store(apply_mask(first, source.mask)),
        _level_count(settings, size),
        source.store,
        lambda image, size: np.maximum(downsample(image, size), 0),
    )
    up = partial(_tent, radius=settings.filter_radius)
    return combine(downs, source, upsample=up, last=linear)


def gain(settings: PygfxBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the number of levels."""
    return float(_level_count(settings, size))


def _level_count(settings: PygfxBloom, size: tuple[int, int]) -> int:
    longer = max(1, max(size) // 2)
    return min(settings.levels, math.floor(math.log2(longer)) + 1)


def _average(image: Array, size: tuple[int, int]) -> Array:
    """Weight the groups by 1 / (1 + luminance), also of negative ones; 0 where it is undefined."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return finite(
            weighted_mean((1 / (1 + luminance(mean)), mean) for _, mean in groups(image, size))
        )


def _tent(image: Array, size: tuple[int, int], radius: float) -> Array:
    """Sample the tent. Its step in texels is the same along both axes."""
    step = radius * image.shape[1]
    return tent(image, size, step, step)
