"""Kernels for pixels of another size."""

from __future__ import annotations

import math

import numpy as np

from vkbloom._psf.base import Array


def box_resample(
    kernel: Array,
    point: tuple[int, int],
    scale: tuple[float, float],
    room: tuple[int, int] | None = None,
) -> Array:
    """Resample a kernel: a new pixel gets the energy of the area that it covers."""
    within = room or (None, None)
    edges = [_edges(*axis) for axis in zip(kernel.shape[:2], point, scale, within, strict=True)]
    # The axis that shrinks more comes first, so that a thin result takes little memory.
    for axis in sorted((0, 1), key=lambda axis: len(edges[axis]) / kernel.shape[axis]):
        kernel = integrals(kernel, edges[axis], axis)
    return np.ascontiguousarray(kernel)


def integrals(values: Array, edges: Array, axis: int) -> Array:
    """Integrate between edges along an axis; values are constant within a pixel."""
    lines = np.moveaxis(values, axis, 0)
    sums = np.concatenate([np.zeros((1, *lines.shape[1:])), lines.cumsum(axis=0)])
    at = np.clip(edges, 0, len(lines))
    lower = np.minimum(at.astype(np.intp), len(lines) - 1)
    part: Array = np.asarray(at - lower).reshape(-1, *[1] * (lines.ndim - 1))
    between: Array = np.diff(sums[lower] + part * lines[lower], axis=0)
    return np.asarray(np.moveaxis(between, 0, axis), np.float64)


def _edges(count: int, point: int, scale: float, room: int | None) -> Array:
    """Return the edges of the new pixels, in old pixels."""
    reach = max(point + 0.5, count - point - 0.5) * scale
    # Rounding must not add an empty pixel.
    pixels = max(0, math.ceil(reach - 0.5 - 1e-9))
    if room is not None:
        pixels = min(pixels, room // 2)
    return np.asarray((np.arange(-pixels, pixels + 2) - 0.5) / scale + point + 0.5)
