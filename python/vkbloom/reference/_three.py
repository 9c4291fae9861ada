"""Bloom of three.js: UnrealBloomPass and BloomNode.

From mrdoob/three.js: examples/jsm/postprocessing/UnrealBloomPass.js with pull requests #31528
(kernels), #32517 (factor 3) and, in r187, #34479 (merged taps),
examples/jsm/shaders/LuminosityHighPassShader.js @ 0255e15dd1d4,
examples/jsm/tsl/display/BloomNode.js @ 07e4c12b3840.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from vkbloom._formats import LUMINANCE, LUMINANCE_7_DIGITS

from ._image import BlurInput
from ._sampling import Array, halve_size, sample, scale_size, size_of
from ._threshold import apply_mask, luminance, smooth_step, with_alpha

if TYPE_CHECKING:
    from vkbloom._methods.three import ThreeBloom

_TAP_COUNTS = (6, 10, 14, 18, 22)
_FACTORS = (1.0, 0.8, 0.6, 0.4, 0.2)
_LUMINANCE = np.array(LUMINANCE_7_DIGITS)
_NODES_LUMINANCE = np.array(LUMINANCE)


def passes(source: BlurInput, settings: ThreeBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 and "bright" have half the size of the frame, rounded, and each next level half the size
    of the one above. BloomNode multiplies by its scale and floors. Each level is the image above it
    ("bright" for down_0), blurred by a Gaussian along x, then along y, with taps one pixel of the
    level apart. Newer variants read neighbouring taps by one bilinear sample. up_0 is the sum of
    the levels, enlarged bilinearly and multiplied by their factors and tints; the bloom is up_0,
    bilinear. In rgba8unorm buffers, up_0 is divided by the sum of the factors, 3.
    """
    channels, is_node = source.image.shape[2], settings.variant == "node"
    frame = size_of(source.image)
    size = scale_size(frame, settings.resolution_scale) if is_node else halve_size(frame, 1)
    image = source.store(apply_mask(_prefilter(sample(source.image, size), settings), source.mask))
    framebuffers = {"bright": image}
    total = np.zeros_like(image)
    level = size
    for k, factor in enumerate(_factors(settings.radius)):
        level = halve_size(level, 0 if is_node else 1) if k else size
        ratio = image.shape[1] / level[0]
        taps = _taps(k, settings)
        x_taps = [(offset * ratio, weight) for offset, weight in taps]
        horizontal = source.store(sample(image, level, x_taps=x_taps))
        image = source.store(sample(horizontal, level, y_taps=taps))
        framebuffers[f"down_{k}"] = image
        tinted = source.store(image * with_alpha(settings.tints[k], channels))
        total = total + factor * sample(tinted, size)
    sum_of_factors = sum(_factors(settings.radius)) if source.store.holds_means else 1.0
    framebuffers["up_0"] = source.store(total / sum_of_factors)
    framebuffers["bloom"] = source.store.end(
        sum_of_factors * sample(framebuffers["up_0"], source.size)
    )
    return framebuffers


def gain(settings: ThreeBloom, size: tuple[int, int]) -> float | Array:
    """Return the bloom of a flat image of 1: about 3, because each kernel sums to nearly 1."""
    value, total = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0]), np.zeros(3)
    for k, factor in enumerate(_factors(settings.radius)):
        value *= sum(weight for _, weight in _taps(k, settings)) ** 2
        total = total + factor * value * np.asarray(settings.tints[k])
    return total if np.ptp(total) else float(total[0])


def _factors(radius: float) -> list[float]:
    return [factor + (1.2 - factor - factor) * radius for factor in _FACTORS]


def _taps(level: int, settings: ThreeBloom) -> list[tuple[float, float]]:
    """Return offset and weight of each sample, in pixels of the level."""
    count = _TAP_COUNTS[level]
    deviation = count / 3
    weights = [
        0.39894 * math.exp(-0.5 * i * i / deviation**2) / deviation if i < count else 0.0
        for i in range(count + 1)
    ]
    if settings.variant == "r185":
        half = [(float(i), weights[i]) for i in range(1, count)]
    else:
        pairs = [(i, weights[i], weights[i + 1]) for i in range(1, count, 2)]
        half = [((i * a + (i + 1) * b) / (a + b), a + b) for i, a, b in pairs]
    return [(-at, weight) for at, weight in half] + [(0.0, weights[0]), *half]


def _prefilter(rgb: Array, settings: ThreeBloom) -> Array:
    if settings.threshold is None:
        return rgb
    grey = luminance(rgb, _LUMINANCE if settings.variant == "r185" else _NODES_LUMINANCE)
    return rgb * smooth_step((grey - settings.threshold) / settings.smooth_width)
