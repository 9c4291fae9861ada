"""Bloom of Babylon.js' DefaultRenderingPipeline.

From BabylonJS/Babylon.js: extractHighlights.fragment.fx @ bc81a5f32960, kernelBlur.fragment.fx
@ 445b0404049f, bloomMerge.fragment.fx @ 02e530f440cd, thinBlurPostProcess.ts @ 076e49a15333,
bloomEffect.ts @ 05c105649f04.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._sampling import Array, sample, scale_size, size_of
from ._threshold import apply_mask, luminance

if TYPE_CHECKING:
    from vkbloom._methods.babylon import BabylonBloom


def passes(source: BlurInput, settings: BabylonBloom) -> dict[str, Array]:
    """Return the framebuffers.

    "bright" has `scale` times the size of the frame, floored: one bilinear tap, which is kept where
    its luminance is at least threshold^(1 / 2.2). down_0 is "bright", blurred along x, then along
    y; each sample is two taps of a Gaussian. The bloom is down_0, bilinear.
    """
    size = scale_size(size_of(source.image), settings.scale)
    bright = source.store(apply_mask(_prefilter(sample(source.image, size), settings), source.mask))
    taps = _taps(settings)
    horizontal = source.store(sample(bright, size, x_taps=taps))
    blurred = source.store(sample(horizontal, size, y_taps=taps))
    bloom = source.store.end(sample(blurred, source.size))
    return {"bright": bright, "down_0": blurred, "bloom": bloom}


def gain(settings: BabylonBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, or 0 above the threshold."""
    weights = sum(weight for _, weight in _taps(settings))
    return float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0]) * weights**2


def strength(settings: BabylonBloom) -> float:
    """Return the factor of the bloom: the weight is a field of its own."""
    return settings.intensity * settings.weight


def _prefilter(rgb: Array, settings: BabylonBloom) -> Array:
    if settings.threshold is None:
        return rgb
    return np.where(luminance(rgb) >= settings.threshold ** (1 / 2.2), rgb, 0.0)


def _taps(settings: BabylonBloom) -> list[tuple[float, float]]:
    """Return offset and weight of each sample, in pixels."""
    # The nearest number to the kernel's size that is 1 modulo 4.
    wanted = math.floor(max(settings.kernel * settings.scale, 1) + 0.5)
    near = [n for n in range(max(wanted - 2, 1), wanted + 3) if n % 4 == 1]
    count = max(min(near, key=lambda n: abs(n - wanted)), 3)
    middle = (count - 1) // 2
    weights = np.exp(-4.5 * (2 * np.arange(count) / (count - 1) - 1) ** 2)
    weights /= weights.sum()
    taps = []
    for i in range(0, middle + 1, 2):
        j = min(i + 1, middle)
        if i == j:
            taps.append((0.0, float(weights[middle])))
            continue
        offset = i - middle + weights[j] / (weights[i] + weights[j])
        weight = weights[i] + weights[j] / (2 if j == middle else 1)
        taps += [(float(offset), float(weight)), (float(-offset), float(weight))]
    return taps
