"""The kernels that make one picture of others: least squares, regularized and non-negative."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from vkbloom._extras import import_extra

Array = NDArray[np.float64]
_TILE: Final = 64  # pixels along a side of the tiles whose products are added up
# Exponents of the strength of the regularization, beside the mean of the picture's products.
_STRENGTHS: Final = (-10.0, 4.0)
# The least share of the picture's square that is noise: single floats round.
_ROUNDED: Final = 1e-13
# How many values are drawn to scale the errors, in how many pictures at least.
_DRAWN, _MIN_DRAWS = 8000, 2
_QUANTILE: Final = 1.96  # of 95 % of the normal distribution


class Kernels(NamedTuple):
    """Kernels (n, h, w), their standard deviations, the residual (H, W) and the noise's."""

    values: Array
    error: Array
    residual: Array
    noise: float


def recover_kernels(
    sources: Array, target: Array, used: NDArray[np.bool_], size: tuple[int, int], given: Any
) -> Kernels:
    """Return the kernels of height and width `size`, one of each source (H, W).

    The sum of the convolutions is the target at the used pixels, to which `seen` belong. `given`:
    the standard deviation of its noise, or None.
    """
    place, total = seen(target.shape, size), float(target[used] @ target[used])
    count = int(np.count_nonzero(used))
    square, products = _normal_equations(sources, target, used, size)
    is_lit = square.diagonal().reshape(len(sources), -1).any(axis=1)
    if not is_lit.all():
        which = f" by the kernel of position {np.argmin(is_lit)}" if len(sources) > 1 else ""
        raise ValueError(f"image: no pixel that is compared gets light{which}")

    def rest(explained: float) -> float:
        return max(total - explained, _ROUNDED * total)

    def misfit(explained: float) -> float:
        left = rest(explained)
        return left / given**2 if given else count * float(np.log(left))

    regular = _regularize(square, products, size, misfit)
    inverse: Array = np.asarray(np.linalg.inv(regular), np.float64)
    noise: float = given or float(np.sqrt(rest(float(products @ inverse @ products)) / count))
    values = _solve(regular, products, inverse @ products)
    error = noise * np.sqrt(np.diag(inverse))
    # Pictures with other noise show how far such kernels err that are not negative.
    generator, ratios = np.random.default_rng(0), []
    for _ in range(max(_MIN_DRAWS, _DRAWN // len(values))):
        drawn = noise * generator.standard_normal(target.shape) * used
        other = square @ values + _correlate(sources, drawn[place])
        again = _solve(regular, other, inverse @ other)
        ratios.append(np.abs(again - values) / error)
    error *= float(np.quantile(ratios, 0.95)) / _QUANTILE
    # The windows of the image count from the last tap on.
    kernels, errors = (part.reshape(-1, *size)[:, ::-1, ::-1] for part in (values, error))
    made = np.zeros(target.shape)
    for source, kernel in zip(sources, kernels, strict=True):
        made[place] += _scipy("signal").fftconvolve(source, kernel, "valid")
    return Kernels(kernels, errors, np.where(used, made - target, 0.0), noise)


def seen(shape: tuple[int, ...], size: tuple[int, int]) -> tuple[slice, ...]:
    """Return the pixels whose light comes from inside of the picture alone."""
    sides = zip(shape, size, strict=True)
    return tuple(slice(own - 1 - own // 2, side - own // 2) for side, own in sides)


def _scipy(name: str) -> Any:
    return import_extra(f"scipy.{name}", "fit", "Recovering a kernel")


def _correlate(sources: Array, values: Array) -> Array:
    """Return the products of the windows of the sources with the values of the pixels seen."""
    convolve = _scipy("signal").fftconvolve
    return np.concatenate([convolve(x, values[::-1, ::-1], "valid").ravel() for x in sources])


def _normal_equations(
    sources: Array, target: Array, used: NDArray[np.bool_], size: tuple[int, int]
) -> tuple[Array, Array]:
    """Return the square of the matrix whose rows are windows of the sources, and its products."""
    taps, place = size[0] * size[1], seen(target.shape, size)
    square, products = np.zeros((len(sources) * taps,) * 2), np.zeros(len(sources) * taps)
    windows, wanted, chosen = sliding_window_view(sources, size, (1, 2)), target[place], used[place]
    for y, x in itertools.product(*(range(0, side, _TILE) for side in wanted.shape)):
        tile = slice(y, y + _TILE), slice(x, x + _TILE)
        near = [i for i, one in enumerate(windows) if one[tile].any()]
        if not near:
            continue
        lines = [windows[i][tile][chosen[tile]].reshape(-1, taps) for i in near]
        rows = np.concatenate(lines, axis=1)
        indices = np.concatenate([np.arange(i * taps, (i + 1) * taps) for i in near])
        square[np.ix_(indices, indices)] += rows.T @ rows
        products[indices] += rows.T @ wanted[tile][chosen[tile]]
    return square, products


def _regularize(
    square: Array, products: Array, size: tuple[int, int], misfit_of: Callable[[float], float]
) -> Array:
    """Return the square with the penalty of the largest marginal likelihood."""
    linalg, optimize = _scipy("linalg"), _scipy("optimize")

    def misfit(strength: float) -> float:
        """Return twice the negative logarithm of the marginal likelihood."""
        factor = linalg.cho_factor(_penalize(square, size, strength), lower=True, overwrite_a=True)
        explained = float(products @ linalg.cho_solve(factor, products))
        volume = 2 * float(np.log(np.diag(factor[0])).sum()) - len(square) * np.log(10) * strength
        return float(volume + misfit_of(explained))

    options = {"bounds": _STRENGTHS, "method": "bounded", "options": {"xatol": 0.1}}
    return _penalize(square, size, float(optimize.minimize_scalar(misfit, **options).x))


def _penalize(square: Array, size: tuple[int, int], strength: float) -> Array:
    """Return the square with a penalty on the Laplacian of each kernel, which is 0 outside."""
    lines = [2 * np.eye(side) - np.eye(side, k=1) - np.eye(side, k=-1) for side in size]
    laplacian = np.kron(lines[0], np.eye(size[1])) + np.kron(np.eye(size[0]), lines[1])
    penalty, result = laplacian @ laplacian, square.copy()
    scale = float(np.trace(square)) / len(square) * 10**strength
    for first in range(0, len(square), len(penalty)):
        part = slice(first, first + len(penalty))
        result[part, part] += scale * penalty
    return result


def _solve(regular: Array, products: Array, start: Array) -> Array:
    """Return the non-negative solution by block pivoting, from the plain one."""
    free, values, fewest, patience = start > 0, start.copy(), len(start) + 1, 3
    for _ in range(10 * len(start)):
        values = np.zeros(len(start))
        values[free] = np.linalg.solve(regular[np.ix_(free, free)], products[free])
        slope = regular @ values - products
        below = -1e-12 * abs(products).max()
        wrong = np.flatnonzero(np.where(free, values < 0, slope < below))
        if not wrong.size:
            break
        if wrong.size < fewest:
            fewest, patience = wrong.size, 3
        elif patience:
            patience -= 1
        else:
            wrong = wrong[-1:]
        free[wrong] = ~free[wrong]
    return np.maximum(values, 0.0)
