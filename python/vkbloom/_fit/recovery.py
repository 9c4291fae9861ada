"""The kernel of a lens from a pair of pictures: without its glare, and with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._fit.kernels import Array, recover_kernels, seen
from vkbloom._fit.losses import light
from vkbloom._image_arguments import check_image
from vkbloom._numbers import check_above, check_floats, check_size
from vkbloom._psf.base import PSF
from vkbloom._psf.sampled import samples
from vkbloom._psf.varying import Varying
from vkbloom._public import public


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
    Computing 33(6), 2011, https://doi.org/10.1137/110821172), and a penalty on the square of the
    kernel's Laplacian. Its strength is that of the largest marginal likelihood: MacKay, "Bayesian
    Interpolation", Neural Computation 4(3), 1992, https://doi.org/10.1162/neco.1992.4.3.415.
    `error` is the posterior standard deviation, whose intervals hold on the average over the
    kernel: Wahba, "Bayesian Confidence Intervals for the Cross-Validated Smoothing Spline", Journal
    of the Royal Statistical Society B 45(1), 1983,
    https://doi.org/10.1111/j.2517-6161.1983.tb01239.x. Time and memory grow with the square of the
    number of values of all kernels. Channels that are equal have one kernel.
    """
    width, height = check_size("size", size)
    sharp, spread, used = _check_pictures(image, glared, mask, (height, width))
    weights, grid = _weights_of(positions, sharp.shape[:2])
    if (count := int(np.count_nonzero(used))) <= len(weights) * width * height:
        raise ValueError(f"size: {count} pixels are compared, too few for kernels of this size")
    given = None if noise is None else check_above("noise", noise, 0)
    is_grey = all((part == part[..., :1]).all() for part in (sharp, spread))
    found = [
        recover_kernels(
            weights * sharp[..., channel], spread[..., channel], used, (height, width), given
        )
        for channel in range(1 if is_grey else 3)
    ]
    kernels, error, residual = (
        np.stack([part[index] for part in found], axis=-1) for index in range(3)
    )
    if is_grey:
        kernels, error, residual = kernels[..., 0], error[..., 0], np.repeat(residual, 3, axis=2)
    shape = (len(grid[1]) or 1, len(grid[0]) or 1)
    kernels, error = (part.reshape(*shape, *part.shape[1:]) for part in (kernels, error))
    deviation = given or float(np.sqrt(np.mean([part.noise**2 for part in found])))
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
    used[seen(shape, size)] = True
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
