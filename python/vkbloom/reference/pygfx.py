"""pygfx' PhysicalBasedBloomPass.

From pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from .image import Storage
from .pyramid import downsample, groups
from .sampling import Array
from .threshold import luminance, masked
from .upsampling import combine, linear, tent

__all__ = ["gain", "passes"]


class PygfxSettings(Protocol):
    """What this blur reads of `vkbloom.PygfxBloom`."""

    @property
    def levels(self) -> int: ...
    @property
    def filter_radius(self) -> float: ...
    @property
    def karis_average(self) -> bool: ...


def passes(
    glow: Array,
    settings: PygfxSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 is the floored half of the frame, each next level that of the one before, by 13 taps;
    with `karis_average` down_0 is the mean of their five groups, weighted by
    1 / (1 + luminance) alone. up_k = down_k + tent(up_k+1) with taps `filter_radius` of the width
    apart along both axes; the bloom is up_0, bilinear. Nothing goes below 0.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1, 3 or, with alpha, 4 channels.
    settings : vkbloom.PygfxBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies down_0.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    image, downs = glow, []
    for k in range(_level_count(settings, (width, height))):
        width, height = max(1, width // 2), max(1, height // 2)
        averaged = settings.karis_average and k == 0
        image = (_averaged if averaged else _plain)(image, (width, height))
        image = np.maximum(image, 0)
        image = store(masked(image, mask) if k == 0 else image)
        downs.append(image)
    ones = [1.0] * len(downs)
    return {
        **{f"down_{k}": down for k, down in enumerate(downs)},
        **combine(
            downs,
            size,
            store,
            own=ones,
            coarse=ones,
            upsample=lambda image, larger: _tent(image, larger, settings.filter_radius),
            last=linear,
        ),
    }


def gain(settings: PygfxSettings, size: tuple[int, int]) -> float:
    """Return what a flat image of 1 becomes: the number of levels."""
    return float(_level_count(settings, size))


def _level_count(settings: PygfxSettings, size: tuple[int, int]) -> int:
    longer = max(1, max(size) // 2)
    return min(settings.levels, math.floor(math.log2(longer)) + 1)


def _plain(image: Array, size: tuple[int, int]) -> Array:
    return downsample(image, size, False)


def _averaged(image: Array, size: tuple[int, int]) -> Array:
    total, shares = np.zeros((size[1], size[0], image.shape[2])), np.zeros((size[1], size[0], 1))
    for _, mean in groups(image, size):
        grey = mean if mean.shape[2] == 1 else luminance(mean)
        share = 1 / (1 + np.maximum(grey, 0))
        total += share * mean
        shares += share
    return total / shares


def _tent(image: Array, size: tuple[int, int], radius: float) -> Array:
    """Read the tent; its step in uv is larger along y by the aspect: the same in texels."""
    step = radius * image.shape[1]
    return tent(image, size, step, step)
