"""Settings, images and slow loops for the tests of `vkbloom.reference`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.testing import assert_allclose
from numpy.typing import NDArray

Array = NDArray[np.float64]

TUTORIAL_SUM = 0.227027 + 3 * (0.1945946 + 0.1216216 + 0.054054 + 0.016216)
DEFERRED = (0.175713, 0.121703, 0.065984, 0.028002, 0.0093)


def assert_close(actual: Any, expected: Any) -> None:
    """Equal except for the rounding of doubles in sums of a few hundred products."""
    assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


def random_image(height: int, width: int, channels: int = 3, seed: int = 1) -> Array:
    return np.random.default_rng(seed).random((height, width, channels))


def flat(value: float, height: int = 12, width: int = 16, channels: int = 3) -> Array:
    return np.full((height, width, channels), value)


# Slow loops: one pixel, one tap, one texel at a time, in normalized coordinates


def texture(image: Array, u: float, v: float) -> Array:
    """Bilinear value at (u, v), 0..1 from edge to edge, clamped to the edge."""
    height, width, _ = image.shape
    x, y = u * width - 0.5, v * height - 0.5
    left, top = math.floor(x), math.floor(y)
    value = np.zeros(image.shape[2])
    for row, row_weight in ((top, top + 1 - y), (top + 1, y - top)):
        for column, column_weight in ((left, left + 1 - x), (left + 1, x - left)):
            texel = image[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]
            value += row_weight * column_weight * texel
    return value


def draw(size: tuple[int, int], shader: Callable[[float, float], Array]) -> Array:
    """Call the shader at each pixel's centre."""
    width, height = size
    return np.array(
        [
            [shader((i + 0.5) / width, (j + 0.5) / height) for i in range(width)]
            for j in range(height)
        ]
    )


def slow_blur(
    image: Array, size: tuple[int, int], step: tuple[float, float], settings: Any
) -> Array:
    """One pass of the tutorial's shader; `step` in normalized coordinates."""

    def shader(u: float, v: float) -> Array:
        value: Array = settings.weights[0] * texture(image, u, v)
        for i in range(settings.first_tap, len(settings.weights)):
            for side in (i, -i):
                tap = texture(image, u + side * step[0], v + side * step[1])
                value = value + settings.blur_strength * settings.weights[i] * tap
        return value

    return draw(size, shader)


def slow_separable(glow: Array, settings: Any, size: tuple[int, int]) -> Array:
    height, width, _ = glow.shape
    bloom = np.zeros((size[1], size[0], glow.shape[2]))
    for scale, strength in settings.layers:
        step = settings.blur_scale * scale
        step_y = step / (width if settings.texel == "x" else height)
        image = glow
        for loop in range(settings.loops):
            vertical = slow_blur(image, (width, height), (0, step_y), settings)
            target = size if loop == settings.loops - 1 else (width, height)
            image = slow_blur(vertical, target, (step / width, 0), settings)
        bloom = bloom + strength * image
    return bloom


def slow_direct(glow: Array, settings: Any, size: tuple[int, int]) -> Array:
    height, width, _ = glow.shape
    n = len(settings.weights) - 1
    weights = [
        settings.weights[abs(i)] * (settings.blur_strength if i else 1) for i in range(-n, n + 1)
    ]

    def shader(u: float, v: float) -> Array:
        value = np.zeros(glow.shape[2])
        for j, row_weight in enumerate(weights, start=-n):
            for i, column_weight in enumerate(weights, start=-n):
                step = settings.blur_scale
                tap = texture(glow, u + i * step / width, v + j * step / height)
                value += row_weight * column_weight * tap
        return value

    return draw(size, shader)


def slow_taps(
    image: Array, size: tuple[int, int], taps: Sequence[tuple[float, float, float]]
) -> Array:
    """Sum of taps (x, y, weight), x and y in texels of the image."""
    height, width, _ = image.shape

    def shader(u: float, v: float) -> Array:
        value = np.zeros(image.shape[2])
        for x, y, weight in taps:
            value += weight * texture(image, u + x / width, v + y / height)
        return value

    return draw(size, shader)


DOWN_13 = (
    [(0, 0, 0.125)]
    + [(x, y, 0.125) for x in (-1, 1) for y in (-1, 1)]
    + [(x, y, 0.0625) for x, y in ((-2, 0), (2, 0), (0, -2), (0, 2))]
    + [(x, y, 0.03125) for x in (-2, 2) for y in (-2, 2)]
)


def tent(radius: float) -> list[tuple[float, float, float]]:
    weights = {-1: 1, 0: 2, 1: 1}
    return [
        (x * radius, y * radius, weights[x] * weights[y] / 16) for x in weights for y in weights
    ]


def slow_pyramid(
    glow: Array, sizes: list[tuple[int, int]], radius: float, size: tuple[int, int]
) -> Array:
    """Sum of the levels, added on the way up, then divided by their number."""
    downs = [glow]
    for level in sizes:
        downs.append(slow_taps(downs[-1], level, DOWN_13))
    total = downs[-1]
    for down, level in zip(downs[-2:0:-1], sizes[-2::-1], strict=True):
        total = down + slow_taps(total, level, tent(radius))
    return slow_taps(total, size, tent(radius)) / len(sizes)


def slow_dual_kawase(
    glow: Array, sizes: list[tuple[int, int]], offset: float, size: tuple[int, int]
) -> Array:
    half = offset / 2
    diagonals = [(x, y) for x in (-half, half) for y in (-half, half)]
    down = [(0, 0, 0.5)] + [(x, y, 1 / 8) for x, y in diagonals]
    axials = [(-offset, 0), (offset, 0), (0, -offset), (0, offset)]
    up = [(x, y, 1 / 12) for x, y in axials] + [(x, y, 1 / 6) for x, y in diagonals]
    image = glow
    for level in sizes:
        image = slow_taps(image, level, down)
    for level in sizes[-2::-1]:
        image = slow_taps(image, level, up)
    return slow_taps(image, size, up)
