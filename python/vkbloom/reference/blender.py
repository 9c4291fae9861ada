"""The bloom of Blender's Glare node, in high quality.

Formulas from the compositor of Blender 4.5, source/blender/nodes/composite/nodes/
node_composite_glare.cc (@ f92418fbe034: the same formulas).
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from .image import Storage
from .pyramid import downsample
from .sampling import Array, sample
from .threshold import brightest, masked
from .upsampling import combine, linear, tent_of_target

__all__ = ["gain", "passes"]

# (x, y) in texels, and the share, of the 13 taps' five groups.
_GROUPS = (
    (((-1, -1), (1, -1), (-1, 1), (1, 1)), 0.5),
    (((-2, -2), (0, -2), (-2, 0), (0, 0)), 0.125),
    (((0, -2), (2, -2), (0, 0), (2, 0)), 0.125),
    (((-2, 0), (0, 0), (-2, 2), (0, 2)), 0.125),
    (((0, 0), (2, 0), (0, 2), (2, 2)), 0.125),
)


class BlenderSettings(Protocol):
    """What this blur reads of `vkbloom.BlenderGlare`."""

    @property
    def threshold(self) -> float | None: ...
    @property
    def smoothness(self) -> float: ...
    @property
    def size(self) -> float: ...
    @property
    def maximum(self) -> float | None: ...


def passes(
    glow: Array,
    settings: BlenderSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    There are n = floor(log2(size * shorter side)) levels, one at least. down_0 has the frame's
    size and what of it is above the threshold; each next level is the floored half of the one
    before by 13 taps, which in the first such step are weighted, within each of their groups of
    four, by 1 / (1 + brightest channel). up_k = down_k + tent(up_k+1) with a tent of one pixel of
    the larger level; the bloom is up_0 / n.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
    settings : vkbloom.BlenderGlare
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies down_0 after the threshold.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_n-1", "up_n-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    count = max(1, math.floor(math.log2(max(1.0, min(width, height) * settings.size))))
    downs = [store(masked(_highlights(glow, settings), mask))]
    for k in range(1, count):
        width, height = max(1, width // 2), max(1, height // 2)
        shrink = _weighted_taps if k == 1 else _plain_taps
        downs.append(store(shrink(downs[-1], (width, height))))
    ones = [1.0] * count
    return {
        **{f"down_{k}": down for k, down in enumerate(downs)},
        **combine(
            downs,
            size,
            store,
            own=ones,
            coarse=ones,
            upsample=tent_of_target,
            last=linear,
            gain=1 / count,
        ),
    }


def gain(settings: BlenderSettings) -> float:
    """Return what a flat image of 1 becomes: what passes the threshold, for the rest keeps it."""
    return float(_highlights(np.ones((1, 1, 1)), settings)[0, 0, 0])


def _highlights(rgb: Array, settings: BlenderSettings) -> Array:
    """Scale colours to the brightness that the threshold leaves of their own."""
    if settings.threshold is None:
        return rgb
    low = settings.threshold
    high = math.inf if settings.maximum is None else low + settings.maximum
    value = brightest(rgb)
    # So narrow that nothing of the soft parts lies below 0 or beyond the other end.
    at_low = min(settings.smoothness, low, high - low)
    at_high = min(settings.smoothness, high, high - low)
    kept = -_smooth_min(-value, -low, at_low)
    if high < math.inf:
        kept = _smooth_min(kept, high, at_high)
    scale = (kept - low) / np.where(value > 0, value, 1)
    return np.where(value > 0, rgb * scale, 0)


def _smooth_min(values: Array, end: float, width: float) -> Array:
    """Return the smaller of two numbers, less h^2 width / 4 with h = 1 - their distance / width.

    The quadratic smooth minimum of Inigo Quilez, "Smooth minimum"; h is 0 at least.
    """
    smaller: Array = np.minimum(values, end)
    if width > 0:
        h = np.maximum(width - np.abs(values - end), 0) / width
        smaller = smaller - h * h * width / 4
    return smaller


def _plain_taps(image: Array, size: tuple[int, int]) -> Array:
    return downsample(image, size, False)


def _weighted_taps(image: Array, size: tuple[int, int]) -> Array:
    result = np.zeros((size[1], size[0], image.shape[2]))
    for places, group_share in _GROUPS:
        total, shares = np.zeros_like(result), np.zeros((size[1], size[0], 1))
        for x, y in places:
            tap = sample(image, size, [(float(x), 1.0)], [(float(y), 1.0)])
            share = 1 / (1 + np.maximum(brightest(tap), 0))
            total += share * tap
            shares += share
        result += group_share * total / shares
    return result
