"""Filament's bloom at its low quality.

From google/filament: bloomDownsample2x.mat @ 9f62dc2f2f53, bloomDownsample9.mat and
bloomDownsample.mat @ 523a261b1052, bloomUpsample.mat @ 9f62dc2f2f53,
filament/src/PostProcessManager.cpp @ 003e5005713c.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._pyramid import downsample
from ._sampling import WIDEST_LEVEL, Array, halve_size, sample, size_of, weighted_mean
from ._threshold import apply_mask, brightest, firefly_weight
from ._upsampling import combine, halvings, linear, tent_of_target

if TYPE_CHECKING:
    from vkbloom._methods.filament import FilamentBloom


def passes(source: BlurInput, settings: FilamentBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 is `resolution` high, and its width follows from the aspect of the frame, up to
    `WIDEST_LEVEL`; both sides are floored to multiples of 16. The frame is halved until down_0 is
    more than half of it, then reduced to down_0, each time by the 3 x 3 binomial. The first of
    these steps includes the threshold. Each further level has half the size, by nine taps, or by
    13 if a side of the level above is odd. up_k = down_k + tent(up_k+1) with a tent of one pixel of
    the larger level; the bloom is up_0, bilinear, divided by the number of levels.
    """
    image, above, top = source.image, size_of(source.image), settings.resolution
    across = min(top * above[0] / above[1], WIDEST_LEVEL)
    level = 16 * max(1, math.floor(across / 16)), 16 * max(1, math.floor(top / 16))
    threshold, mask = settings.threshold, source.mask
    while level[0] * 2 < above[0] or level[1] * 2 < above[1]:
        above = halve_size(above)
        image = source.store(apply_mask(_reduce(image, above, threshold, settings.highlight), mask))
        threshold = mask = None
    first = source.store(apply_mask(_reduce(image, level, threshold, settings.highlight), mask))
    longer = math.floor(max(across, top))
    count = min(settings.levels, math.floor(math.log2(longer)) + 1)

    def shrink(larger: Array, size: tuple[int, int]) -> Array:
        is_odd = larger.shape[0] % 2 or larger.shape[1] % 2
        return (downsample if is_odd else _nine_taps)(larger, size)

    downs = halvings(first, count, source.store, shrink)
    return combine(downs, source, upsample=tent_of_target, last=linear, gain=1 / count)


def gain(settings: FilamentBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: what passes the threshold."""
    if settings.threshold is None:
        return 1.0
    kept = max(0.0, 1.0 - settings.threshold)
    return kept / (1 + kept / settings.highlight)


def _reduce(
    image: Array, size: tuple[int, int], threshold: float | None, highlight: float
) -> Array:
    """Sample the image convolved with (1 2 1)^2 / 16, and apply the threshold.

    Along each axis, the texels around a position have the weights (1 - f, 2 - f, 1 + f, f) / 4.
    They are read as two pairs, which makes four taps. With a threshold, each tap is also weighted
    by 1 / (1 + brightest channel).
    """
    taps: list[tuple[Array, Array]] = []
    for rows, row_share in _pairs(image, size[1]):
        for columns, column_share in _pairs(rows.swapaxes(0, 1), size[0]):
            tap = columns.swapaxes(0, 1)
            share = row_share * column_share.swapaxes(0, 1)
            if threshold is not None:
                share = share * firefly_weight(brightest(tap))
            taps.append((share, tap))
    mean = weighted_mean(taps)
    if threshold is None:
        return mean
    kept = np.maximum(mean[..., :3] - threshold, 0)
    value = brightest(mean)
    # Not brightest(kept): channels below the threshold are equal there.
    most = np.maximum(value - threshold, 0)
    divisor = 1 + most / highlight
    compressed = kept / divisor
    # This threshold subtracts. Alpha is multiplied by the factor of the brightest channel.
    factor = np.where(value > 0, most / divisor / np.where(value > 0, value, 1), 0)
    return np.concatenate([compressed, factor * mean[..., 3:]], axis=-1)


def _pairs(image: Array, count: int) -> list[tuple[Array, Array]]:
    """Return the two taps along the first axis, and their weights, (count, 1, 1)."""
    length = image.shape[0]
    positions = (np.arange(count) + 0.5) * length / count - 0.5
    lower = np.floor(positions)
    f = (positions - lower)[:, np.newaxis, np.newaxis]
    near = [image[np.clip(lower + i, 0, length - 1).astype(np.intp)] for i in (-1, 0, 1, 2)]
    left = ((1 - f) * near[0] + (2 - f) * near[1]) / (3 - 2 * f)
    right = ((1 + f) * near[2] + f * near[3]) / (1 + 2 * f)
    return [(left, (3 - 2 * f) / 4), (right, (1 + 2 * f) / 4)]


def _nine_taps(image: Array, size: tuple[int, int]) -> Array:
    """Read 3 x 3 taps, 1.761629 texels apart, the outer ones 7.46602 / 32 along an axis."""
    offset, outer = 1.761629, 7.46602 / 32
    taps = ((-offset, outer), (0.0, 1 - 2 * outer), (offset, outer))
    return sample(image, size, taps, taps)
