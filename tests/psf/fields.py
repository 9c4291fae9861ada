"""Fields of kernels, and the sum over all pixels that defines what is made of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Field = Callable[[float, float], Array]
Y, X = (axis.astype(float) for axis in np.mgrid[-10:11, -10:11])


def normalized(kernel: Array) -> Array:
    return np.asarray(kernel / kernel.sum())


def round_spot(u: float, v: float) -> Array:
    """Return a Gaussian that grows to the corner."""
    deviation = 0.9 * (1 + 2 * np.hypot(u, v))
    return normalized(np.exp(-(X**2 + Y**2) / (2 * deviation**2)))


def elliptic(u: float, v: float) -> Array:
    """Return a Gaussian that is longer along the radius."""
    angle = np.arctan2(v, u)
    along = X * np.cos(angle) + Y * np.sin(angle)
    across = Y * np.cos(angle) - X * np.sin(angle)
    length = 1.1 * (1 + 1.5 * np.hypot(u, v))
    return normalized(np.exp(-(along**2) / (2 * length**2) - across**2 / (2 * 1.1**2)))


def coma(u: float, v: float) -> Array:
    """Return a tail of spots that points outwards."""
    shares = np.linspace(0, 1, 5)
    spots = [
        np.exp(-((X - 3 * s * u) ** 2 + (Y - 3 * s * v) ** 2) / (2 * (1 + s) ** 2)) for s in shares
    ]
    return normalized(np.sum(spots, axis=0))


def chromatic(u: float, v: float) -> Array:
    """Return a spot of its own width and place for each channel."""
    spots = [
        np.exp(-((X - c * u) ** 2 + (Y - c * v) ** 2) / (2 * (1.5 + 0.2 * c) ** 2))
        for c in (-1, 0, 1)
    ]
    return np.stack([normalized(spot) for spot in spots], axis=-1)


def vignetted(u: float, v: float) -> Array:
    """Return a spot whose light fades to the corner."""
    return round_spot(u, v) * (1 - 0.5 * (u * u + v * v))


def off_centre(u: float, v: float) -> Array:
    """Return an even-sided spot that is brightest beside the middle."""
    return round_spot(u - 0.3, v + 0.2)[:-1, :-3]


FIELDS: tuple[Field, ...] = (round_spot, elliptic, coma, chromatic, vignetted, off_centre)


def field_of(x: float, y: float, frame: tuple[int, int]) -> tuple[float, float]:
    """Return u and v of a pixel."""
    width, height = frame
    radius = np.hypot(width, height) / 2
    return float((x - (width - 1) / 2) / radius), float((y - (height - 1) / 2) / radius)


def bilinear(kernels: Array, xs: Array, ys: Array) -> Callable[[float, float], Array]:
    """Return the function of a place in pixels between kernels on a grid."""

    def at(x: float, y: float) -> Array:
        rows = np.array([np.interp(y, ys, line) for line in np.eye(len(ys))])
        columns = np.array([np.interp(x, xs, line) for line in np.eye(len(xs))])
        return np.asarray(np.tensordot(np.outer(rows, columns), kernels, 2))

    return at


def scatter(
    image: NDArray[np.floating[Any]],
    kernel_at: Callable[[float, float], Array],
    boundary: str,
    gathers: bool = False,
) -> Array:
    """Return sum over q of image(q) K_q(p - q), where K_q is `kernel_at(x, y)`.

    With `gathers` the sum over q of image(q) K_p(p - q).
    """
    height, width = image.shape[:2]
    kernels = [[as_colours(kernel_at(x, y)) for x in range(width)] for y in range(height)]
    rows, columns = kernels[0][0].shape[:2]
    result = np.zeros((height, width, 3))
    outside = 0 if boundary == "zero" else max(rows, columns)
    down, across = np.arange(rows) - rows // 2, np.arange(columns) - columns // 2
    for y in range(-outside, height + outside):
        for x in range(-outside, width + outside):
            inside = (
                (y % height, x % width)
                if boundary == "wrap"
                else (np.clip(y, 0, height - 1), np.clip(x, 0, width - 1))
            )
            for j in np.flatnonzero((y + down >= 0) & (y + down < height)):
                to_x = x + across
                kept = np.flatnonzero((to_x >= 0) & (to_x < width))
                line = y + down[j]
                taps = (
                    np.array([kernels[line][to_x[i]][j, i] for i in kept]).reshape(-1, 3)
                    if gathers
                    else kernels[inside[0]][inside[1]][j, kept]
                )
                result[line, to_x[kept]] += image[inside] * taps
    return result


def as_colours(kernel: Array) -> Array:
    return np.repeat(kernel[..., np.newaxis], 3, axis=2) if kernel.ndim == 2 else kernel
