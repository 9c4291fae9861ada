"""The kernel of a lens from a pair of pictures: without its glare, and with it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._extras import import_extra
from vkbloom._fit.losses import light
from vkbloom._image_arguments import check_image
from vkbloom._numbers import check_above, check_floats, check_size
from vkbloom._psf.base import PSF
from vkbloom._psf.sampled import samples
from vkbloom._psf.varying import Varying
from vkbloom._public import public

Array = NDArray[np.float64]
# Pixels along a side of the tiles whose products are added up.
_TILE: Final = 64
# Exponents of the strength of the regularization, beside the mean of the picture's products.
_STRENGTHS: Final = (-10.0, 4.0)
# The least share of the picture's square that is noise: single floats round.
_ROUNDED: Final = 1e-13
# How many values are drawn to scale the errors, in how many pictures at least.
_DRAWN: Final = 8000
_MIN_DRAWS: Final = 2
# Of 95 % of the normal distribution.
_QUANTILE: Final = 1.96


@public("vkbloom")
@dataclass(frozen=True, eq=False, kw_only=True)
class RecoveredPSF:
    """What `recover_psf` found.

    Attributes
    ----------
    psf : PSF
        A `vkbloom.psf.samples`; with positions a `vkbloom.psf.Varying`.
    kernels : ndarray of float64, shape (gy, gx, h, w) or (gy, gx, h, w, 3)
        The kernels of all positions; gy and gx are 1 without positions.
    error : ndarray of float64
        The standard deviation of each value, of the shape of `kernels`, or of one kernel without
        positions. The true value is within 1.96 of it in 95 % of all cases.
    residual : ndarray of float64, shape (H, W, 3)
        The picture with the found glare less `glared`, 0 at pixels that were not compared.
    noise : float
        The standard deviation of the values of `glared`: given, or that of the residual.
    positions : (tuple of float, tuple of float)
        The x of the columns of kernels and the y of the rows; both empty without positions.
    """

    psf: PSF
    kernels: Array
    error: Array
    residual: Array
    noise: float
    positions: tuple[tuple[float, ...], tuple[float, ...]]


@public("vkbloom")
@check_arguments
def recover_psf(
    image: NDArray[Any],
    glared: NDArray[Any],
    *,
    size: tuple[int, int],
    positions: Sequence[ArrayLike] | None = None,
    mask: NDArray[Any] | None = None,
    noise: float | None = None,
) -> RecoveredPSF:
    """Find the kernel of a lens from a picture without its glare and the same picture with it.

    Parameters
    ----------
    image, glared : ndarray, shape (H, W, 3) or (H, W, 4)
        The picture without and with glare, in linear light. uint8 is read as value / 255. `image`
        is taken as exact. Alpha is not read.
    size : (int, int)
        Width and height of the kernel in pixels. Light that is spread further is a fault.
    positions : (xs, ys), optional
        The x of the columns and the y of the rows of a grid of kernels, in pixels, where the centre
        of the first pixel is (0, 0). A light shows the kernel of its own place, which is bilinear
        between the positions, and that of the nearest edge outside of them.
    mask : ndarray of bool, shape (H, W), optional
        True at pixels of `glared` that are not compared, such as saturated ones.
    noise : float, optional
        The standard deviation of the values of `glared`. Default: that of the residual.

    Returns
    -------
    RecoveredPSF

    Raises
    ------
    ValueError, TypeError
        The pictures differ in size, or the kernel is larger; fewer pixels are compared than the
        kernels have values; `image` has values that are not finite; an argument is out of range.

    Notes
    -----
    Least squares of the pixels whose light comes from inside of the picture, with non-negative
    kernels (Kim and Park, "Fast Nonnegative Matrix Factorization", SIAM Journal on Scientific
    Computing 33(6), 2011), and a penalty on the square of the kernel's Laplacian. Its strength is
    that of the largest marginal likelihood: MacKay, "Bayesian Interpolation", Neural Computation
    4(3), 1992. `error` is the posterior standard deviation, whose intervals hold on the average
    over the kernel: Wahba, "Bayesian Confidence Intervals for the Cross-Validated Smoothing
    Spline", Journal of the Royal Statistical Society B 45(1), 1983. Time and memory grow with the
    square of the number of values of all kernels. Channels that are equal have one kernel.
    """
    width, height = check_size("size", size)
    sharp, spread, used = _check_pictures(image, glared, mask, (height, width))
    weights, grid = _weights_of(positions, sharp.shape[:2])
    given = None if noise is None else check_above("noise", noise, 0)
    is_grey = all((part == part[..., :1]).all() for part in (sharp, spread))
    found = [
        _recover(weights * sharp[..., channel], spread[..., channel], used, (height, width), given)
        for channel in range(1 if is_grey else 3)
    ]
    kernels, error, residual = (
        np.stack([part[index] for part in found], axis=-1) for index in range(3)
    )
    if is_grey:
        kernels, error, residual = kernels[..., 0], error[..., 0], np.repeat(residual, 3, axis=2)
    shape = (len(grid[1]) or 1, len(grid[0]) or 1)
    kernels, error = (part.reshape(*shape, *part.shape[1:]) for part in (kernels, error))
    deviation = given or float(np.sqrt(np.mean([part[3] ** 2 for part in found])))
    is_field = positions is not None
    return RecoveredPSF(
        psf=Varying(kernels, grid) if is_field else samples(kernels[0, 0]),
        kernels=kernels,
        error=error if is_field else error[0, 0],
        residual=residual,
        noise=deviation,
        positions=grid,
    )


def _check_pictures(
    image: Any, glared: Any, mask: Any, size: tuple[int, int]
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the light of both pictures, and which pixels of the second are compared."""
    given = check_image(image), check_image(glared, "glared")
    if given[0].shape[:2] != given[1].shape[:2]:
        raise ValueError(
            f"glared: shape {given[1].shape[:2]} is not the image's, {given[0].shape[:2]}"
        )
    shape = given[0].shape[:2]
    if not np.isfinite(given[0][..., :3]).all():
        raise ValueError("image: a value is not finite")
    if size[0] > shape[0] or size[1] > shape[1]:
        raise ValueError(f"size: {size[1]} x {size[0]} is larger than the image")
    used = np.zeros(shape, np.bool_)
    top, left = ((side - 1) - side // 2 for side in size)
    used[top : shape[0] - size[0] // 2, left : shape[1] - size[1] // 2] = True
    used &= np.isfinite(given[1][..., :3]).all(axis=2)
    if mask is not None:
        ignored = np.asarray(mask)
        if ignored.shape != shape or ignored.dtype != np.bool_:
            raise ValueError(f"mask: {ignored.dtype} {ignored.shape} is not bool {shape}")
        used &= ~ignored
    return light(given[0]), light(given[1]), used


def _weights_of(
    positions: Sequence[ArrayLike] | None, shape: tuple[int, ...]
) -> tuple[Array, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Return the share of each kernel at each pixel, (gy * gx, H, W), and the positions."""
    if positions is None:
        return np.ones((1, *shape)), ((), ())
    if not hasattr(positions, "__len__") or len(positions) != 2:
        raise ValueError("positions: it is not a pair, the x of columns and the y of rows")
    shares: list[Array] = []
    grid: list[tuple[float, ...]] = []
    for name, given, side in zip("xy", positions, shape[::-1], strict=True):
        places: Array = np.array(check_floats("positions", cast("Any", given)), np.float64)
        if places.ndim != 1 or not len(places) or not (np.diff(places) > 0).all():
            raise ValueError(f"positions: those along {name} are not numbers that increase")
        hats = [np.interp(np.arange(side), places, row) for row in np.eye(len(places))]
        shares.append(np.array(hats))
        grid.append(tuple(map(float, places)))
    weights = np.einsum("iy,jx->ijyx", shares[1], shares[0])
    return weights.reshape(-1, *shape), (grid[0], grid[1])


def _recover(
    sources: Array, target: Array, used: NDArray[np.bool_], size: tuple[int, int], noise: Any
) -> tuple[Array, Array, Array, float]:
    """Return the kernels of one channel, (n, h, w), their errors, the residual and the noise."""
    signal = import_extra("scipy.signal", "fit", "Recovering a kernel")
    count = int(np.count_nonzero(used))
    if count <= len(sources) * size[0] * size[1]:
        raise ValueError(f"size: {count} pixels are compared, too few for kernels of this size")
    square, products = _normal_equations(sources, target, used, size)
    facts = _Equations(square, products, float(target[used] @ target[used]), count, size)
    regular = facts.regular(noise)
    inverse: Array = np.asarray(np.linalg.inv(regular), np.float64)
    deviation: float = noise or facts.deviation(inverse)
    values = _nonnegative(regular, products, inverse @ products)
    error = deviation * np.sqrt(np.diag(inverse))
    # Pictures with other noise show how far such kernels err that are not negative.
    generator, ratios = np.random.default_rng(0), []
    for _ in range(max(_MIN_DRAWS, _DRAWN // len(values))):
        drawn = deviation * generator.standard_normal(target.shape) * used
        other = square @ values + _products(sources, drawn, size)
        again = _nonnegative(regular, other, inverse @ other)
        ratios.append(np.abs(again - values) / error)
    error *= float(np.quantile(ratios, 0.95)) / _QUANTILE
    # The windows of the image count from the last tap on.
    kernels, errors = (part.reshape(-1, *size)[:, ::-1, ::-1] for part in (values, error))
    made = np.zeros(target.shape)
    top, left = ((side - 1) - side // 2 for side in size)
    inside = made[
        top : top + target.shape[0] - size[0] + 1, left : left + target.shape[1] - size[1] + 1
    ]
    for source, kernel in zip(sources, kernels, strict=True):
        inside += signal.fftconvolve(source, kernel, mode="valid")
    return kernels, errors, np.where(used, made - target, 0.0), deviation


def _normal_equations(
    sources: Array, target: Array, used: NDArray[np.bool_], size: tuple[int, int]
) -> tuple[Array, Array]:
    """Return the square of the matrix whose rows are windows of the sources, and its products."""
    taps = size[0] * size[1]
    square, products = np.zeros((len(sources) * taps,) * 2), np.zeros(len(sources) * taps)
    windows = sliding_window_view(sources, size, axis=(1, 2))
    top, left = ((side - 1) - side // 2 for side in size)
    rows, columns = windows.shape[1:3]
    for y, x in itertools.product(range(0, rows, _TILE), range(0, columns, _TILE)):
        tile = slice(y, min(y + _TILE, rows)), slice(x, min(x + _TILE, columns))
        place = tuple(
            slice(part.start + by, part.stop + by)
            for part, by in zip(tile, (top, left), strict=True)
        )
        chosen = used[place]
        near = [i for i, one in enumerate(windows) if one[tile].any()]
        lines = np.concatenate([windows[i][tile][chosen].reshape(-1, taps) for i in near], axis=1)
        indices = np.concatenate([np.arange(i * taps, (i + 1) * taps) for i in near])
        square[np.ix_(indices, indices)] += lines.T @ lines
        products[indices] += lines.T @ target[place][chosen]
    return square, products


def _products(sources: Array, values: Array, size: tuple[int, int]) -> Array:
    """Return the products of the windows of the sources with values at pixels."""
    signal = import_extra("scipy.signal", "fit", "Recovering a kernel")
    top, left = ((side - 1) - side // 2 for side in size)
    inside = values[top : len(values) - size[0] // 2, left : values.shape[1] - size[1] // 2]
    mirrored = inside[::-1, ::-1]
    return np.concatenate(
        [signal.fftconvolve(one, mirrored, mode="valid").ravel() for one in sources]
    )


@dataclass(frozen=True, eq=False)
class _Equations:
    """Normal equations, the sum of squares of the picture, how many values it has, and the size."""

    square: Array
    products: Array
    total: float
    count: int
    size: tuple[int, int]

    def regular(self, noise: float | None) -> Array:
        """Return the square with the penalty of the largest marginal likelihood."""
        linalg = import_extra("scipy.linalg", "fit", "Recovering a kernel")
        optimize = import_extra("scipy.optimize", "fit", "Recovering a kernel")

        def misfit(strength: float) -> float:
            """Return twice the negative logarithm of the marginal likelihood."""
            factor = linalg.cho_factor(self._penalized(strength), lower=True, overwrite_a=True)
            rest = self.total - float(self.products @ linalg.cho_solve(factor, self.products))
            volume = 2 * float(np.log(np.diag(factor[0])).sum())
            volume -= len(self.square) * np.log(10) * strength
            rest = max(rest, _ROUNDED * self.total)
            fit = rest / noise**2 if noise else self.count * float(np.log(rest))
            return float(volume + fit)

        best = optimize.minimize_scalar(
            misfit, bounds=_STRENGTHS, method="bounded", options={"xatol": 0.1}
        )
        return self._penalized(float(best.x))

    def _penalized(self, strength: float) -> Array:
        penalty, result = _roughness(self.size), self.square.copy()
        scale = float(np.trace(result)) / len(result) * 10**strength
        for first in range(0, len(result), len(penalty)):
            part = slice(first, first + len(penalty))
            result[part, part] += scale * penalty
        return result

    def deviation(self, inverse: Array) -> float:
        """Return the standard deviation of what the kernels do not explain."""
        rest = self.total - float(self.products @ inverse @ self.products)
        return float(np.sqrt(max(rest, _ROUNDED * self.total) / self.count))


def _roughness(size: tuple[int, int]) -> Array:
    """Return the square of the Laplacian of a kernel that is 0 outside."""
    lines = [2 * np.eye(side) - np.eye(side, k=1) - np.eye(side, k=-1) for side in size]
    laplacian = np.kron(lines[0], np.eye(size[1])) + np.kron(np.eye(size[0]), lines[1])
    return np.asarray(laplacian @ laplacian)


def _nonnegative(regular: Array, products: Array, start: Array) -> Array:
    """Return the non-negative solution by block pivoting, from the plain one."""
    free, values, fewest, patience = start > 0, start.copy(), len(start) + 1, 3
    for _ in range(10 * len(start)):
        values = np.zeros(len(start))
        values[free] = np.linalg.solve(regular[np.ix_(free, free)], products[free])
        slope = regular @ values - products
        wrong = np.flatnonzero(
            (free & (values < 0)) | (~free & (slope < -1e-12 * abs(products).max()))
        )
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
