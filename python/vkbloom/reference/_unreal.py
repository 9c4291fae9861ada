"""three.js' UnrealBloomPass, with the kernels and the factor of 2025.

From mrdoob/three.js: examples/jsm/postprocessing/UnrealBloomPass.js with pull requests #31528
(kernels) and #32517 (factor 3), examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._sampling import Array, sample
from ._threshold import luminance, masked

if TYPE_CHECKING:
    from vkbloom._methods.unreal import UnrealBloom

__all__ = ["gain", "passes"]

_TAP_COUNTS = (6, 10, 14, 18, 22)
_FACTORS = (1.0, 0.8, 0.6, 0.4, 0.2)
_LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750])
_NODES_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def passes(source: BlurInput, settings: UnrealBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 and "bright" have half the size of the frame, rounded (with `node` floored), and each
    next level half the size of the one above. Each level is the image above it ("bright" for
    down_0), blurred by a Gaussian along x, then along y, with taps one pixel of the level apart.
    up_0 is the sum of the levels, enlarged bilinearly and multiplied by their factors; the bloom is
    up_0, bilinear. In rgba8unorm buffers, up_0 is divided by the sum of the factors, 3.
    """
    height, width, _ = source.image.shape
    half = _halved((width, height), settings)
    image = source.store(masked(_prefilter(sample(source.image, half), settings), source.mask))
    framebuffers = {"bright": image}
    total = np.zeros_like(image)
    for k, factor in enumerate(_factors(settings.radius)):
        width, height = _halved((width, height), settings)
        ratio = image.shape[1] / width
        x_taps = [(i * ratio, weight) for i, weight in _kernel(k)]
        horizontal = source.store(sample(image, (width, height), x_taps=x_taps))
        image = source.store(sample(horizontal, (width, height), y_taps=_kernel(k)))
        framebuffers[f"down_{k}"] = image
        total += factor * sample(image, half)
    sum_of_factors = sum(_factors(settings.radius)) if source.store.holds_means else 1.0
    framebuffers["up_0"] = source.store(total / sum_of_factors)
    framebuffers["bloom"] = source.store.end(
        sum_of_factors * sample(framebuffers["up_0"], source.size)
    )
    return framebuffers


def gain(settings: UnrealBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: about 3, because each kernel sums to nearly 1."""
    value, total = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0]), 0.0
    for k, factor in enumerate(_factors(settings.radius)):
        value *= sum(weight for _, weight in _kernel(k)) ** 2
        total += factor * value
    return total


def _halved(size: tuple[int, int], settings: UnrealBloom) -> tuple[int, int]:
    """Return half of a size, at least 1: rounded, ties up, or floored with `node`."""
    more = 0 if settings.node else 1
    width, height = (max(1, (side + more) // 2) for side in size)
    return width, height


def _factors(radius: float) -> list[float]:
    return [factor + (1.2 - factor - factor) * radius for factor in _FACTORS]


def _kernel(level: int) -> list[tuple[float, float]]:
    count = _TAP_COUNTS[level]
    deviation = count / 3
    return [
        (float(i), 0.39894 * math.exp(-0.5 * i * i / deviation**2) / deviation)
        for i in range(1 - count, count)
    ]


def _prefilter(rgb: Array, settings: UnrealBloom) -> Array:
    if settings.threshold is None:
        return rgb
    grey = luminance(rgb, _NODES_LUMINANCE if settings.node else _LUMINANCE)
    t = np.clip((grey - settings.threshold) / settings.smooth_width, 0, 1)
    return rgb * (t * t * (3 - 2 * t))
