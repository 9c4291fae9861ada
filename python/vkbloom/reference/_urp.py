"""Bloom of Unity's Universal Render Pipeline, its Gaussian filter without high quality.

From Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.universal:
Shaders/PostProcessing/Bloom.shader @ 00d472fae509,
Runtime/Passes/PostProcess/BloomPostProcessPass.cs @ 13e28e026298.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._levels import halved
from ._sampling import Array, sample
from ._threshold import masked, soften
from ._upsampling import combine, flat_gain, linear

if TYPE_CHECKING:
    from vkbloom._methods.unity import UrpBloom

__all__ = ["gain", "passes"]

# As in the shader; their sum is 1 - 1e-8.
_WEIGHTS = (0.22702703, 0.19459459, 0.12162162, 0.05405405, 0.01621622)


def passes(source: BlurInput, settings: UrpBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 has half the size of the frame: one bilinear tap, clamped, then the soft threshold. Each
    further level has half the size of the one above. Nine taps two texels apart reduce its width,
    then nine taps one pixel apart blur its height. up_k mixes the level with the smaller one, by
    the scatter; the bloom is up_0. Both are enlarged bilinearly.
    """
    height, width, _ = source.image.shape
    level = halved((width, height))
    downs = [source.store(masked(_prefilter(sample(source.image, level), settings), source.mask))]
    for _ in range(1, _level_count(settings, level)):
        level = halved(level)
        horizontal = source.store(sample(downs[-1], level, x_taps=_taps(2.0)))
        downs.append(source.store(sample(horizontal, level, y_taps=_taps(1.0))))
    own, coarse = _shares(settings, len(downs))
    return combine(downs, source, own=own, coarse=coarse, upsample=linear, last=linear)


def gain(settings: UrpBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the threshold may change it, the mixes do not."""
    count = _level_count(settings, halved(size))
    first = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0])
    kernel = _WEIGHTS[0] + 2 * sum(_WEIGHTS[1:])
    return first * flat_gain(*_shares(settings, count), [kernel ** (2 * k) for k in range(count)])


def _level_count(settings: UrpBloom, size: tuple[int, int]) -> int:
    return min(max(math.floor(math.log2(max(size)) - 1), 1), settings.iterations)


def _shares(settings: UrpBloom, count: int) -> tuple[list[float], list[float]]:
    share = 0.05 + (0.95 - 0.05) * settings.scatter
    return [1 - share] * count, [share] * count


def _prefilter(rgb: Array, settings: UrpBloom) -> Array:
    # The clamp is not applied to alpha.
    kept = np.concatenate([np.minimum(rgb[..., :3], settings.clamp_max), rgb[..., 3:]], axis=-1)
    if settings.threshold is not None:
        half_width = settings.threshold * settings.knee
        kept = soften(kept, settings.threshold, half_width, 4 * half_width + 1e-4, 1e-4)
    positive: Array = np.maximum(kept, 0)
    return positive


def _taps(step: float) -> list[tuple[float, float]]:
    return [(i * step, _WEIGHTS[abs(i)]) for i in range(-4, 5)]
