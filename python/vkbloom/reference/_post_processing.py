"""Bloom of Unity's Post Processing Stack v2.

From Unity-Technologies/PostProcessing @ 32c3155207d3: PostProcessing/Shaders/Builtins/Bloom.shader,
PostProcessing/Shaders/Sampling.hlsl, PostProcessing/Runtime/Effects/Bloom.cs.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom._formats import MAX_HALF

from ._image import BlurInput
from ._pyramid import downsample
from ._sampling import Array, box, size_of
from ._tape import join_curves
from ._threshold import apply_mask, soften, with_alpha
from ._upsampling import Filter, combine, halvings, tent

if TYPE_CHECKING:
    from vkbloom._methods.unity import PostProcessingBloom


def passes(source: BlurInput, settings: PostProcessingBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 has half the size of the frame, less reduced along one axis by `anamorphic_ratio`; it is
    clamped, thresholded and coloured. Each further level has half the size of the one above. All
    read 13 taps, with `fast` the mean of four. up_k = down_k + tent(up_k+1) and bloom =
    tent(up_0), whose radius is a texel times a factor of 0.5 to 1.5 that follows from `diffusion`
    and the size; with `fast` the tent is the mean of four samples.
    """
    channels = source.image.shape[2]
    first, count, radius = _plan(size_of(source.image), settings)

    reduced: Filter = partial(downsample, scale=(0.5, 0.5))
    enlarged: Filter = partial(tent, x_step=radius, y_step=radius)
    if settings.fast:
        reduced, enlarged = box, partial(box, distance=radius / 2)
    bright = _prefilter(reduced(source.image, first), settings)
    bright = source.store(apply_mask(bright * with_alpha(settings.color, channels), source.mask))
    downs = halvings(bright, count, source.store, reduced)
    return combine(downs, source, upsample=enlarged, last=enlarged)


def gain(settings: PostProcessingBloom, size: tuple[int, int]) -> float | Array:
    """Return the bloom of a flat image of 1: the number of levels, times the colour."""
    first = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0])
    total = first * _plan(size, settings)[1] * np.asarray(settings.color)
    return total if np.ptp(total) else float(total[0])


def _plan(
    size: tuple[int, int], settings: PostProcessingBloom
) -> tuple[tuple[int, int], int, float]:
    """Return the size of the first level, the number of levels and the radius of the tent."""
    ratio = settings.anamorphic_ratio
    width = max(1, math.floor(size[0] / (2 - max(-ratio, 0))))
    height = max(1, math.floor(size[1] / (2 - max(ratio, 0))))
    halvings = math.log2(max(width, height)) + min(settings.diffusion, 10) - 10
    count = min(max(math.floor(halvings), 1), 16)
    return (width, height), count, 0.5 + halvings - math.floor(halvings)


def _prefilter(rgb: Array, settings: PostProcessingBloom) -> Array:
    limit = min(MAX_HALF, linear_light(settings.clamp))
    # The clamp is not applied to alpha.
    kept = np.concatenate([np.minimum(rgb[..., :3], limit), rgb[..., 3:]], axis=-1)
    threshold = None if settings.threshold is None else linear_light(settings.threshold)
    return soften(kept, threshold, settings.knee, wider=1e-5, least=1e-4)


def linear_light(value: Any) -> Any:
    """Return the light of a value in sRGB; above 1 it is a power of 2.2, as Unity converts it."""
    power = join_curves(value, 1.0, ((value + 0.055) / 1.055) ** 2.4, value**2.2)
    return join_curves(value, 0.04045, value / 12.92, power)
