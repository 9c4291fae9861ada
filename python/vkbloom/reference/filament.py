"""Filament's bloom at its low quality.

From google/filament: bloomDownsample2x.mat @ 9f62dc2f2f53, bloomDownsample9.mat and
bloomDownsample.mat @ 523a261b1052, bloomUpsample.mat @ 9f62dc2f2f53,
filament/src/PostProcessManager.cpp @ 003e5005713c.
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


class FilamentSettings(Protocol):
    """What this blur reads of `vkbloom.FilamentBloom`."""

    @property
    def threshold(self) -> float | None: ...
    @property
    def levels(self) -> int: ...
    @property
    def resolution(self) -> int: ...
    @property
    def highlight(self) -> float: ...


def passes(
    glow: Array,
    settings: FilamentSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 is `resolution` high and as wide as the frame's aspect asks for, both floored to
    multiples of 16. The frame is halved until less than halving remains, then reduced to down_0,
    each time by the 3 x 3 binomial, whose first use also has the threshold. Further levels are
    floored halves, by nine taps, or 13 where a side of the level above is odd. The levels are
    added on the way up by a tent of one pixel of the larger level, the bloom is up_0, bilinear,
    divided by the number of levels.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
    settings : vkbloom.FilamentBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies what the threshold lets through.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    width_of_frame, height_of_frame = width, height
    top = settings.resolution
    first = (
        16 * max(1, math.floor(top * width / height / 16)),
        16 * max(1, math.floor(top / 16)),
    )
    image, threshold = glow, settings.threshold
    while first[0] * 2 < width or first[1] * 2 < height:
        width, height = max(1, width // 2), max(1, height // 2)
        image = _reduce(image, (width, height), threshold, settings.highlight)
        image = store(masked(image, mask))
        threshold = mask = None
    downs = [store(masked(_reduce(image, first, threshold, settings.highlight), mask))]
    longer = math.floor(max(top * width_of_frame / height_of_frame, top))
    count = min(settings.levels, math.floor(math.log2(longer)) + 1)
    for k in range(1, count):
        level = (max(1, first[0] >> k), max(1, first[1] >> k))
        even = downs[-1].shape[0] % 2 == 0 and downs[-1].shape[1] % 2 == 0
        down = _nine_taps(downs[-1], level) if even else downsample(downs[-1], level, False)
        downs.append(store(down))
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


def gain(settings: FilamentSettings) -> float:
    """Return what a flat image of 1 becomes: what passes the threshold."""
    if settings.threshold is None:
        return 1.0
    kept = max(0.0, 1.0 - settings.threshold)
    return kept / (1 + kept / settings.highlight)


def _reduce(
    image: Array, size: tuple[int, int], threshold: float | None, highlight: float
) -> Array:
    """Read the image convolved with (1 2 1)^2 / 16 between its texels, and apply the threshold.

    The texels around a position weigh (1 - f, 2 - f, 1 + f, f) / 4 along each axis. They are
    read as two pairs, so that four taps remain, which with a threshold are weighted by
    1 / (1 + their brightest channel).
    """
    total, shares = np.zeros((size[1], size[0], image.shape[2])), np.zeros((size[1], size[0], 1))
    for rows, row_share in _pairs(image, size[1]):
        for columns, column_share in _pairs(rows.swapaxes(0, 1), size[0]):
            tap = columns.swapaxes(0, 1)
            share = row_share * column_share.swapaxes(0, 1)
            if threshold is not None:
                share = share / (1 + np.maximum(brightest(tap), 0))
            total += share * tap
            shares += share
    mean: Array = total / shares
    if threshold is None:
        return mean
    kept = np.maximum(mean[..., :3] - threshold, 0)
    compressed = kept / (1 + brightest(kept) / highlight)
    # The threshold subtracts: alpha takes the factor of the brightest channel.
    value = brightest(mean)
    factor = np.where(value > 0, brightest(compressed) / np.where(value > 0, value, 1), 0)
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
