"""Bloom of Unity's Universal Render Pipeline, its Gaussian filter without high quality.

From Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.universal:
Shaders/PostProcessing/Bloom.shader @ 00d472fae509,
Runtime/Passes/PostProcess/BloomPostProcessPass.cs @ 13e28e026298.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from .image import Storage
from .sampling import Array, sample
from .threshold import masked, soften
from .upsampling import combine, flat_gain, linear

__all__ = ["gain", "passes"]

# As printed in the shader; their sum is 1 - 1e-8.
_WEIGHTS = (0.22702703, 0.19459459, 0.12162162, 0.05405405, 0.01621622)


class UrpSettings(Protocol):
    """What this blur reads of `vkbloom.UrpBloom`."""

    @property
    def threshold(self) -> float | None: ...
    @property
    def knee(self) -> float: ...
    @property
    def clamp_max(self) -> float: ...
    @property
    def scatter(self) -> float: ...
    @property
    def iterations(self) -> int: ...


def passes(
    glow: Array,
    settings: UrpSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 is one bilinear tap of the frame at the floored half of its size, clamped and past the
    soft threshold. Each further level is the floored half of the one above, which nine taps two
    texels apart reduce in width, nine taps one pixel apart then blur in height. On the way up the
    smaller level, bilinear, and the level are mixed by the scatter; the bloom is up_0, bilinear.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
    settings : vkbloom.UrpBloom
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
    width, height = max(1, width // 2), max(1, height // 2)
    downs = [store(masked(_prefilter(sample(glow, (width, height)), settings), mask))]
    for _ in range(1, _level_count(settings, (width, height))):
        width, height = max(1, width // 2), max(1, height // 2)
        across = store(sample(downs[-1], (width, height), x_taps=_taps(2.0)))
        downs.append(store(sample(across, (width, height), y_taps=_taps(1.0))))
    own, coarse = _shares(settings, len(downs))
    return {
        **{f"down_{k}": down for k, down in enumerate(downs)},
        **combine(downs, size, store, own=own, coarse=coarse, upsample=linear, last=linear),
    }


def gain(settings: UrpSettings, size: tuple[int, int]) -> float:
    """Return what a flat image of 1 becomes: what passes the threshold, for all mixes keep it."""
    half = (max(1, size[0] // 2), max(1, size[1] // 2))
    count = _level_count(settings, half)
    first = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0])
    kernel = _WEIGHTS[0] + 2 * sum(_WEIGHTS[1:])
    return first * flat_gain(*_shares(settings, count), [kernel ** (2 * k) for k in range(count)])


def _level_count(settings: UrpSettings, size: tuple[int, int]) -> int:
    return min(max(math.floor(math.log2(max(size)) - 1), 1), settings.iterations)


def _shares(settings: UrpSettings, count: int) -> tuple[list[float], list[float]]:
    share = 0.05 + (0.95 - 0.05) * settings.scatter
    return [1 - share] * count, [share] * count


def _prefilter(rgb: Array, settings: UrpSettings) -> Array:
    # The clamp is not alpha's.
    kept = np.concatenate([np.minimum(rgb[..., :3], settings.clamp_max), rgb[..., 3:]], axis=-1)
    if settings.threshold is not None:
        half_width = settings.threshold * settings.knee
        kept = soften(kept, settings.threshold, half_width, 4 * half_width + 1e-4, 1e-4)
    positive: Array = np.maximum(kept, 0)
    return positive


def _taps(step: float) -> list[tuple[float, float]]:
    return [(i * step, _WEIGHTS[abs(i)]) for i in range(-4, 5)]
