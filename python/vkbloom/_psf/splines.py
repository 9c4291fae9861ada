"""Kernels that are moved by parts of a pixel and scaled, by splines of the fifth degree."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._psf.base import Array


def moved_and_scaled(kernel: Array, shift: tuple[float, float], scale: float) -> Array:
    """Return a kernel (h, w) of the same sum, shifted by (x, y) pixels after its width is scaled.

    A kernel without negative values gets none, where a spline would overshoot.
    """
    if shift == (0, 0) and scale == 1:
        return kernel
    rows, columns = (
        _resampling(side, move, scale) for side, move in zip(kernel.shape, shift[::-1], strict=True)
    )
    made = rows @ kernel @ columns.T
    if (kernel >= 0).all():
        made = np.maximum(made, 0)
    total, wanted = made.sum(), kernel.sum()
    return np.asarray(made * (wanted / total if total > 0 else 1))


def _resampling(side: int, shift: float, scale: float) -> Array:
    """Return the matrix from the values of a line to those of the line that is moved and scaled."""
    centre = side // 2
    places = (np.arange(side) - centre - shift) / scale + centre
    return np.asarray(_basis(places[:, np.newaxis] - np.arange(side)) @ _inverse(side))


@functools.lru_cache(64)
def _inverse(side: int) -> Array:
    """Return the matrix from values to coefficients of a spline that is 0 far outside."""
    lines = np.arange(side, dtype=np.float64)
    return np.asarray(np.linalg.inv(_basis(lines[:, np.newaxis] - lines)))


def _basis(distance: NDArray[np.floating[Any]]) -> Array:
    """Return the B-spline of the fifth degree."""
    x = np.abs(distance)
    three, two, one = (np.maximum(end - x, 0) ** 5 for end in (3, 2, 1))
    return np.asarray((three - 6 * two + 15 * one) / 120)
