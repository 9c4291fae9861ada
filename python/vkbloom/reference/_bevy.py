"""Bevy's bloom.

From bevyengine/bevy, tag v0.19.1 (b56fc29d3016), crates/bevy_post_process/src/bloom: bloom.wgsl,
mod.rs (sizes), upsampling_pipeline.rs (factors).
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._pyramid import downsample, groups
from ._sampling import WIDEST_LEVEL, Array
from ._threshold import apply_mask, luminance, soften
from ._upsampling import Shares, combine, flat_gain, halvings, tent

if TYPE_CHECKING:
    from vkbloom._methods.bevy import BevyBloom


def passes(source: BlurInput, settings: BevyBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 is `max_mip_dimension` high, and its width follows from the aspect of the frame, up to
    `WIDEST_LEVEL`. Each
    next level has half the size. With p_g the five groups of the 13 taps, each times its share,
    down_0 is the sum of p_g / (1 + luminance(p_g) / 4), at least 0.0001, followed by the soft
    threshold. The other levels are the plain 13 taps. In up_k, the smaller level has the share
    f_k+1, and the level itself 1 - f_k+1 ("mix") or 1 ("add"). The scale multiplies the distances
    of all taps.
    """
    height, width, _ = source.image.shape
    limit = settings.max_mip_dimension
    scale = (settings.scale_x, settings.scale_y)
    up = partial(tent, x_step=settings.scale_x, y_step=settings.scale_y)
    level = (min(max(1, math.floor(width * limit / height + 0.5)), WIDEST_LEVEL), limit)
    first = source.store(apply_mask(_prefilter(source.image, level, settings), source.mask))
    shrink = partial(downsample, scale=scale)
    downs = halvings(first, _level_count(settings), source.store, shrink)
    return combine(downs, source, shares=shares(settings), upsample=up, last=up)


def gain(settings: BevyBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1.

    The groups' weights darken it to 0.5 / (1 + 0.5 / 4) + 4 * 0.125 / (1 + 0.125 / 4) = 0.929.
    """
    first = _threshold(np.full((1, 1, 3), 0.5 / 1.125 + 0.5 / 1.03125), settings)
    return float(first[0, 0, 0]) * flat_gain(shares(settings), [1.0] * _level_count(settings))


def _level_count(settings: BevyBloom) -> int:
    return max(math.floor(math.log2(settings.max_mip_dimension)), 2) - 1


def _prefilter(image: Array, size: tuple[int, int], settings: BevyBloom) -> Array:
    total = np.zeros((size[1], size[0], image.shape[2]))
    for share, mean in groups(image, size, (settings.scale_x, settings.scale_y)):
        part = share * mean
        total += part / (1 + np.maximum(luminance(part), 0.0) / 4)
    # The lower bound is not applied to alpha.
    total[..., :3] = np.maximum(total[..., :3], 1e-4)
    return _threshold(total, settings)


def _threshold(rgb: Array, settings: BevyBloom) -> Array:
    return soften(rgb, settings.threshold, settings.knee, added=4e-5, least=1e-5)


def shares(settings: BevyBloom) -> Shares:
    """Return the shares of level k and of level k + 1 in up_k."""
    mixed = settings.composite == "mix"
    last = _level_count(settings) - 1
    factors = []
    for level in range(1, last + 1):
        x = level / last
        boost = 1 - (1 - x) ** (1 / (1 - settings.low_frequency_boost_curvature))
        boost *= settings.low_frequency_boost * (1 - settings.intensity if mixed else 1)
        beyond = (x - settings.high_pass_frequency) / settings.high_pass_frequency
        factors.append((settings.intensity + boost) * (1 - np.clip(beyond, 0.0, 1.0)))
    return [1 - f if mixed else 1.0 for f in factors], factors
