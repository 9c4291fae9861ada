"""Bevy's bloom.

From bevyengine/bevy, tag v0.19.1 (b56fc29d3016), crates/bevy_post_process/src/bloom: bloom.wgsl,
mod.rs (sizes), upsampling_pipeline.rs (factors).
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from .image import Storage
from .pyramid import downsample, groups
from .sampling import Array
from .threshold import luminance, masked, soften
from .upsampling import combine, flat_gain, tent

__all__ = ["gain", "passes"]


class BevySettings(Protocol):
    """What this blur reads of `vkbloom.BevyBloom`."""

    @property
    def threshold(self) -> float | None: ...
    @property
    def knee(self) -> float: ...
    @property
    def composite(self) -> str: ...
    @property
    def intensity(self) -> float: ...
    @property
    def low_frequency_boost(self) -> float: ...
    @property
    def low_frequency_boost_curvature(self) -> float: ...
    @property
    def high_pass_frequency(self) -> float: ...
    @property
    def max_mip_dimension(self) -> int: ...
    @property
    def scale_x(self) -> float: ...
    @property
    def scale_y(self) -> float: ...


def passes(
    glow: Array,
    settings: BevySettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 is `max_mip_dimension` high and as wide as the frame's aspect asks for, each next the
    floored half. With p_g the five groups of the 13 taps, each times its share, down_0 is the
    sum of p_g / (1 + luminance(p_g) / 4), at least 0.0001, past the soft threshold; the other
    levels are the plain 13 taps. On the way up the smaller level counts f_k+1 and the level
    itself 1 - f_k+1 ("mix") or 1 ("add"). The scale multiplies all distances of taps.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1, 3 or, with alpha, 4 channels.
    settings : vkbloom.BevyBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies down_0 after the threshold.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    limit = settings.max_mip_dimension
    scale = (settings.scale_x, settings.scale_y)

    def stretched(image: Array, size: tuple[int, int]) -> Array:
        return tent(image, size, *scale)

    level = (max(1, math.floor(width * limit / height + 0.5)), limit)
    framebuffers = {"down_0": store(masked(_prefilter(glow, level, settings), mask))}
    downs = [framebuffers["down_0"]]
    for k in range(1, _level_count(settings)):
        level = (max(1, level[0] // 2), max(1, level[1] // 2))
        downs.append(store(downsample(downs[-1], level, False, scale)))
        framebuffers[f"down_{k}"] = downs[-1]
    own, coarse = _shares(settings)
    ups = combine(downs, size, store, own=own, coarse=coarse, upsample=stretched, last=stretched)
    return {**framebuffers, **ups}


def gain(settings: BevySettings) -> float:
    """Return what a flat image of 1 becomes.

    The groups' weights darken it to 0.5 / (1 + 0.5 / 4) + 4 * 0.125 / (1 + 0.125 / 4) = 0.929.
    """
    first = _threshold(np.full((1, 1, 3), 0.5 / 1.125 + 0.5 / 1.03125), settings)
    return float(first[0, 0, 0]) * flat_gain(*_shares(settings), [1.0] * _level_count(settings))


def _level_count(settings: BevySettings) -> int:
    return max(math.floor(math.log2(settings.max_mip_dimension)), 2) - 1


def _prefilter(image: Array, size: tuple[int, int], settings: BevySettings) -> Array:
    total = np.zeros((size[1], size[0], image.shape[2]))
    for share, mean in groups(image, size, (settings.scale_x, settings.scale_y)):
        part = share * mean
        grey = part if part.shape[2] == 1 else luminance(part)
        total += part / (1 + np.maximum(grey, 0.0) / 4)
    # Alpha has no floor.
    total[..., :3] = np.maximum(total[..., :3], 1e-4)
    return _threshold(total, settings)


def _threshold(rgb: Array, settings: BevySettings) -> Array:
    if settings.threshold is None:
        return rgb
    half_width = settings.threshold * settings.knee
    return soften(rgb, settings.threshold, half_width, 4 * (half_width + 1e-5), 1e-5)


def _shares(settings: BevySettings) -> tuple[list[float], list[float]]:
    """Return the shares of level k and of level k + 1 in up_k."""
    mixed = settings.composite == "mix"
    last = _level_count(settings) - 1
    factors = []
    for level in range(1, last + 1):
        x = level / last
        boost = 1 - (1 - x) ** (1 / (1 - settings.low_frequency_boost_curvature))
        boost *= settings.low_frequency_boost * (1 - settings.intensity if mixed else 1)
        beyond = (x - settings.high_pass_frequency) / settings.high_pass_frequency
        factors.append((settings.intensity + boost) * (1 - min(max(beyond, 0.0), 1.0)))
    return [1 - f if mixed else 1.0 for f in factors], factors
