"""The bloom of Blender's Glare node, in high quality.

Formulas from the compositor of Blender 4.5, source/blender/nodes/composite/nodes/
node_composite_glare.cc (@ f92418fbe034: the same formulas).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .image import BlurInput
from .levels import halved
from .pyramid import downsample
from .sampling import Array, sample, weighted_mean
from .threshold import brightest, firefly_weight, masked
from .upsampling import combine, linear, tent_of_target

if TYPE_CHECKING:
    from vkbloom.methods.blender import BlenderGlare

__all__ = ["gain", "passes"]

# (x, y) in texels, and the share, of the 13 taps' five groups.
_GROUPS = (
    (((-1, -1), (1, -1), (-1, 1), (1, 1)), 0.5),
    (((-2, -2), (0, -2), (-2, 0), (0, 0)), 0.125),
    (((0, -2), (2, -2), (0, 0), (2, 0)), 0.125),
    (((-2, 0), (0, 0), (-2, 2), (0, 2)), 0.125),
    (((0, 0), (2, 0), (0, 2), (2, 2)), 0.125),
)


def passes(source: BlurInput, settings: BlenderGlare) -> dict[str, Array]:
    """Return the framebuffers.

    There are n = max(1, floor(log2(size * shorter side))) levels. down_0 has the size of the
    frame and contains its highlights. Each next level has half the size, by 13 taps. In the first
    such step, the taps within each of their groups of four are weighted by
    1 / (1 + brightest channel). up_k = down_k + tent(up_k+1) with a tent of one pixel of the
    larger level; the bloom is up_0 / n.
    """
    height, width, _ = source.image.shape
    count = max(1, math.floor(math.log2(max(1.0, min(width, height) * settings.size))))
    downs = [source.store(masked(_highlights(source.image, settings), source.mask))]
    level = (width, height)
    for k in range(1, count):
        level = halved(level)
        shrink = _weighted_taps if k == 1 else downsample
        downs.append(source.store(shrink(downs[-1], level)))
    return combine(downs, source, upsample=tent_of_target, last=linear, gain=1 / count)


def gain(settings: BlenderGlare, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the threshold may change it, the levels do not."""
    return float(_highlights(np.ones((1, 1, 1)), settings)[0, 0, 0])


def _highlights(rgb: Array, settings: BlenderGlare) -> Array:
    """Scale colours to the part of their brightness that is above the threshold."""
    if settings.threshold is None:
        return rgb
    low = settings.threshold
    high = math.inf if settings.maximum is None else low + settings.maximum
    value = brightest(rgb)
    # The soft parts must not extend below 0 or beyond the other end.
    at_low = min(settings.smoothness, low, high - low)
    at_high = min(settings.smoothness, high, high - low)
    kept = -_smooth_min(-value, -low, at_low)
    if high < math.inf:
        kept = _smooth_min(kept, high, at_high)
    scale = (kept - low) / np.where(value > 0, value, 1)
    return np.where(value > 0, rgb * scale, 0)


def _smooth_min(values: Array, end: float, width: float) -> Array:
    """Return min(value, end) - h^2 width / 4 with h = max(1 - |value - end| / width, 0).

    The quadratic smooth minimum of Inigo Quilez, "Smooth minimum".
    """
    smaller: Array = np.minimum(values, end)
    if width > 0:
        h = np.maximum(width - np.abs(values - end), 0) / width
        smaller = smaller - h * h * width / 4
    return smaller


def _weighted_taps(image: Array, size: tuple[int, int]) -> Array:
    result = np.zeros((size[1], size[0], image.shape[2]))
    for places, group_share in _GROUPS:
        taps = [sample(image, size, [(float(x), 1.0)], [(float(y), 1.0)]) for x, y in places]
        result += group_share * weighted_mean((firefly_weight(brightest(tap)), tap) for tap in taps)
    return result
