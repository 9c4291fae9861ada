"""A field of kernels as few kernels with weights that depend on the place.

The kernels of a field at P places are a matrix (P, taps), which is the product of weights (P, K)
and of K kernels. A field by a function is taken at more and more places, until kernels at places
between these are near enough to the function's.
"""

from __future__ import annotations

import functools
import math
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from vkbloom._array_cache import keep
from vkbloom._psf.base import Array, in_grey
from vkbloom._psf.places import Size, hat_weights

#: The most kernels of a field by a function, beside the mean ones.
MAX_RANK: Final = 128
#: Places along the longer side of a picture that are tried in turn.
_PLACES: Final = (9, 17, 33, 65)
#: A picture of so many pixels has a place at each of them.
_SMALL: Final = 4096
#: Steps between two places, between which weights are linear.
_STEPS: Final = 8
#: The most values of a field: 1 GiB.
_MAX_VALUES: Final = 1 << 27
#: What single floats resolve. A grid is exact to this.
_EXACT: Final = 1e-7
#: Of the tolerance, for kernels that are left out. The rest is for places between those taken.
_SHARE: Final = 0.8
_TESTS: Final = 64


class Field(Protocol):
    """What is used of a `Varying`."""

    @property
    def has_grid(self) -> bool:
        """Whether all kernels are sums of those of a grid."""

    @property
    def kernels(self) -> Any:
        """The kernels of a grid, or those that have weights."""

    @property
    def weights(self) -> Any:
        """The weights of kernels at a grid's places; None: a kernel is at each place."""

    @property
    def tolerance(self) -> float:
        """The accepted error of a function."""

    def grid_of(self, frame: Size) -> tuple[Array, Array]:
        """Return the places of the grid's columns and rows."""

    def grid_kernels(self, frame: Size) -> Array:
        """Return the grid's kernels, (gy, gx, h, w) or (gy, gx, h, w, 3)."""

    def on_grid(self, xs: Any, ys: Any, frame: Size) -> Array:
        """Return the kernels at places, (len(ys), len(xs), h, w, 3)."""


class Components(NamedTuple):
    """Kernels and their weights over a picture.

    Attributes
    ----------
    kernels : ndarray of float64, shape (K, h, w) or (K, h, w, 3)
    weights : ndarray of float64, shape (K, rows, columns)
        At `xs` and `ys`, linear between them.
    xs, ys : ndarray of float64, shape (columns,) and (rows,)
        In pixels.
    error : float
        The largest difference to the field's own kernels at some places, of a channel: of a tap,
        relative to the largest one, or of the result, if a picture of 0 to 1 has the worst pattern,
        relative to the kernel's sum.
    """

    kernels: Array
    weights: Array
    xs: Array
    ys: Array
    error: float

    @property
    def nbytes(self) -> int:
        """The bytes of all arrays."""
        return sum(part.nbytes for part in self[:4])

    def at(self, xs: Array, ys: Array) -> Array:
        """Return the kernels at pairs of places, (len(xs), h, w, ...)."""
        weights = self._weights_at(xs, ys)
        return np.asarray(np.tensordot(weights, self.kernels, (0, 0)))

    def _weights_at(self, xs: Array, ys: Array) -> Array:
        across, down = hat_weights(self.xs, xs), hat_weights(self.ys, ys)
        weights: Array = np.einsum("pj,pi,kji->kp", down, across, self.weights, optimize=True)
        return weights


@keep
def components_of(psf: Field, frame: Size) -> Components:
    """Return the components of a field for a picture."""
    return _of_grid(psf, frame) if psf.has_grid else _of_function(psf, frame)


@functools.lru_cache(256)
def facts_of(psf: Field, frame: Size) -> tuple[int, float]:
    """Return the number of kernels for a picture, and their error."""
    made = components_of(psf, frame)
    return len(made.kernels), made.error


def _of_grid(psf: Field, frame: Size) -> Components:
    if psf.weights is not None:
        kernels, weights = (
            np.asarray(part.array, np.float64) for part in (psf.kernels, psf.weights)
        )
        return Components(kernels, weights, *psf.grid_of(frame), 0.0)
    kernels = psf.grid_kernels(frame)
    rows, columns = kernels.shape[:2]
    count = rows * columns
    kernels = _without_colour(kernels)
    field = kernels.reshape(count, *kernels.shape[2:])
    found, weights = _decompose(field, _EXACT, count)
    xs, ys = psf.grid_of(frame)
    # The columns of a grid share the transforms along rows.
    if columns + count <= 2 * len(found):
        # Column by column, as `grid_rows` has it.
        found, weights = kernels.swapaxes(0, 1).reshape(field.shape), _one_each(rows, columns)
        return Components(found, weights, xs, ys, 0.0)
    made = Components(found, weights.T.reshape(-1, rows, columns), xs, ys, 0.0)
    return made._replace(error=_error(np.tensordot(weights, found, 1), field))


def _one_each(rows: int, columns: int) -> Array:
    """Return the weights of a grid's kernels, column by column: 1 at their own place."""
    weights = np.eye(rows * columns).reshape(columns, rows, columns, rows)
    return weights.swapaxes(2, 3).reshape(-1, rows, columns)


def grid_rows(made: Components) -> int:
    """Return how many kernels are below each other in a grid of kernels; 1: they are no grid."""
    count, rows, columns = made.weights.shape
    is_grid = count == rows * columns and np.array_equal(made.weights, _one_each(rows, columns))
    return rows if is_grid else 1


def _of_function(psf: Field, frame: Size) -> Components:
    width, height = frame
    draw = np.random.default_rng(1)
    tests = (
        draw.integers(0, width, _TESTS).astype(float),
        draw.integers(0, height, _TESTS).astype(float),
    )
    wanted: Array | None = None
    made: Components | None = None
    for most in _PLACES:
        if width * height <= _SMALL:
            columns, rows = width, height
        else:
            columns, rows = (min(max(-(-most * side // max(frame)), 4), side) for side in frame)
        xs, ys = np.linspace(0, width - 1, columns), np.linspace(0, height - 1, rows)
        first = psf.on_grid(xs[:1], ys[:1], frame)
        if made is not None and rows * columns * first.size > _MAX_VALUES:
            break
        kernels = _without_colour(psf.on_grid(xs, ys, frame))
        field = kernels.reshape(-1, *kernels.shape[2:])
        found, weights = _decompose(field, _SHARE * psf.tolerance, MAX_RANK)
        made = _between(found, weights.T.reshape(-1, rows, columns), xs, ys, frame)
        if wanted is None:
            wanted = np.concatenate(
                [psf.on_grid([x], [y], frame)[0] for x, y in zip(*tests, strict=True)]
            )
        given = made.at(*tests)
        made = made._replace(error=_error(in_grey(given) if given.ndim == 3 else given, wanted))
        if made.error <= psf.tolerance or (columns, rows) == frame:
            break
    assert made is not None
    return made


def _without_colour(kernels: Array) -> Array:
    """Return kernels (..., h, w, 3) without channels if all are equal."""
    if kernels.ndim == 5 and (kernels == kernels[..., :1]).all():
        return np.ascontiguousarray(kernels[..., 0])
    return kernels


def _between(kernels: Array, weights: Array, xs: Array, ys: Array, frame: Size) -> Components:
    """Return components whose weights are linear between places that are nearer to each other."""
    fine = [
        np.linspace(0, side - 1, min(side, _STEPS * (len(nodes) - 1) + 1))
        for side, nodes in zip(frame, (xs, ys), strict=True)
    ]
    across, down = (_cubic_weights(nodes, at) for nodes, at in zip((xs, ys), fine, strict=True))
    return Components(kernels, down @ weights @ across.T, fine[0], fine[1], 0.0)


def _cubic_weights(nodes: Array, places: Array) -> Array:
    """Return the shares of evenly spread nodes at places: of the cubic through the nearest four."""
    count = min(len(nodes), 4)
    step = nodes[1] - nodes[0] if len(nodes) > 1 else 1.0
    at = (places - nodes[0]) / step
    lower = np.clip(np.floor(at).astype(int) - (count // 2 - 1), 0, len(nodes) - count)
    weights = np.zeros((len(places), len(nodes)))
    lines = np.arange(len(places))
    for i in range(count):
        others = [j for j in range(count) if j != i]
        factors = [(at - lower - j) / (i - j) for j in others]
        weights[lines, lower + i] = math.prod(factors, start=np.ones(len(places)))
    return weights


def _decompose(field: Array, tolerance: float, most: int) -> tuple[Array, Array]:
    """Return kernels (K, h, w, ...) and weights (P, K) of the kernels of P places."""
    if (field == field[:1]).all():
        return field[:1], np.ones((len(field), 1))
    grey = field.ndim == 3
    values = (field[..., np.newaxis] if grey else field).reshape(len(field), -1, 1 if grey else 3)
    kernels, weights = _mean_kernels(values)
    rest = values - np.tensordot(weights, kernels, 1)
    more, of_more = _leading(rest, values, tolerance, most)
    kernels, weights = np.concatenate([kernels, more]), np.concatenate([weights, of_more], axis=1)
    return kernels.reshape(len(kernels), *field.shape[1:]), weights


def _mean_kernels(values: Array) -> tuple[Array, Array]:
    """Return the kernels (1 or 3, taps, C), and weights by which the rest has a sum of 0.

    The weights are the sums of the places' kernels, and the same for all channels if these are.
    """
    mean, sums = values.mean(axis=0, keepdims=True), values.sum(axis=1)
    means = sums.mean(axis=0)
    if not (means > 1e-6 * np.abs(values).sum(axis=1).max(axis=0)).all():
        return mean, np.ones((len(values), 1))
    if np.ptp(sums, axis=1).max() <= 1e-12 * sums.max():
        weights = sums[:, :1] / means[0]
        # A sum that is the same everywhere but for rounding is no weight.
        weights = np.ones_like(weights) if np.ptp(weights) <= 1e-12 else weights
        return mean, weights
    channels = np.eye(values.shape[2])[:, np.newaxis] * mean
    return channels, sums / means


def _leading(rest: Array, values: Array, tolerance: float, most: int) -> tuple[Array, Array]:
    """Return the kernels and weights of the rest's largest singular values, as few as suffice."""
    flat = rest.reshape(len(rest), -1)
    if len(flat) <= flat.shape[1]:
        squares, vectors = np.linalg.eigh(flat @ flat.T)
        weights = vectors[:, ::-1][:, :most]
        kernels = weights.T @ flat
    else:
        squares, vectors = np.linalg.eigh(flat.T @ flat)
        weights = flat @ vectors[:, ::-1][:, :most]
        # Sums of the rest's kernels, so that theirs are 0, too.
        kernels = weights.T @ flat / np.maximum(squares[::-1][:most], 1e-300)[:, np.newaxis]
    largest = np.maximum(np.abs(weights).max(axis=0), 1e-300)
    kernels, weights = kernels * largest[:, np.newaxis], weights / largest
    some = np.unique(np.linspace(0, len(rest) - 1, 256).astype(int))
    left, of_values = rest[some].copy(), values[some]
    rank = 0
    while rank < len(kernels) and _largest_error(left, of_values) > tolerance:
        left -= np.multiply.outer(weights[some, rank], kernels[rank]).reshape(left.shape)
        rank += 1
    return kernels[:rank].reshape(rank, *rest.shape[1:]), weights[:, :rank]


def _error(made: Array, wanted: Array) -> float:
    """Return the largest error of kernels (P, h, w) or (P, h, w, 3)."""
    channels = 1 if wanted.ndim == 3 else 3
    parts = [part.reshape(len(wanted), -1, channels) for part in (made - wanted, wanted)]
    return _largest_error(*parts)


def _largest_error(differences: Array, values: Array) -> float:
    """Return the largest error of kernels (P, taps, C), as `Components.error` has it."""
    size = np.abs(values)
    above, below = np.maximum(differences, 0), np.maximum(-differences, 0)
    return max(
        float((of_off / np.maximum(of_size, 1e-300)).max())
        for of_off, of_size in (
            (np.maximum(above.max(axis=1), below.max(axis=1)), size.max(axis=1)),
            (np.maximum(above.sum(axis=1), below.sum(axis=1)), size.sum(axis=1)),
        )
    )
