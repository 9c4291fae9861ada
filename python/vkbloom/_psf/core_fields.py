"""The weights of a field of kernels, for the core."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._array_cache import keep
from vkbloom._core_kernel import CoreKernel, core_image
from vkbloom._psf.base import Array
from vkbloom._psf.components import Components, grid_rows
from vkbloom._psf.places import Size, pixel_places, places_before
from vkbloom._psf.varying import Varying

#: Of the image of weights, where one grid is not wider.
_WIDTH: Final = 4096


def core_field(psf: Varying, frame: Size, buffers: Size) -> tuple[Any, ...] | None:
    """Return a field as the core reads it; None if its only kernel has no weights.

    - The number of kernels, how many of them are below each other in a grid, and whether they
      gather.
    - Whether the first weight is 1.
    - Columns and rows of the grid of weights.
    - Images of the weights and of the buffers' places in the grid.
    """
    made = psf.components(frame)
    down, weights = _factors(made)
    unweighted = bool((weights[0] == 1).all())
    if len(made.kernels) == 1 and unweighted:
        return None
    rows, columns = weights.shape[1:]
    kernels = len(made.kernels), down, psf.gathers
    images = _weights(psf, frame), _places(psf, frame, buffers)
    return (*kernels, unweighted, columns, rows, *images)


def _factors(made: Components) -> tuple[int, Array]:
    """Return the rows of a grid of kernels, and the weights of its columns and then of its rows.

    Or 1, and the weights of each kernel.
    """
    if (down := grid_rows(made)) == 1:
        return 1, made.weights
    count, rows, columns = made.weights.shape
    of_kernels = made.weights.reshape(count // down, down, rows, columns)
    return down, np.concatenate([of_kernels.sum(axis=1), of_kernels.sum(axis=0)])


@keep
def _weights(psf: Varying, frame: Size) -> CoreKernel:
    """Return the weights, four in each texel: grids side by side and below each other."""
    weights = _factors(psf.components(frame))[1]
    count, rows, columns = weights.shape
    grids = -(-count // 4)
    across = max(min(_WIDTH // columns, grids), 1)
    down = -(-grids // across)
    texels = np.zeros((down * across * 4, rows, columns), np.float32)
    texels[:count] = weights
    image = texels.reshape(down, across, 4, rows, columns).transpose(0, 3, 1, 4, 2)
    return core_image(image.reshape(down * rows, across * columns, 4))


@keep
def _places(psf: Varying, frame: Size, buffers: Size) -> CoreKernel:
    """Return the place before each column, then each row, and the share of the next place.

    Beside them, of each place, is the first column or row that it is before.
    """
    made = psf.components(frame)
    # The last place is before none, unless it is the only one.
    bounds = [max(len(nodes), 2) for nodes in (made.xs, made.ys)]
    image: NDArray[np.float32] = np.zeros((2, max(*buffers, *bounds), 4), np.float32)
    for line, nodes, at, count in zip(
        image, (made.xs, made.ys), pixel_places(frame, buffers), bounds, strict=True
    ):
        before, line[: len(at), 1] = places_before(nodes, at)
        line[: len(at), 0] = before
        line[:count, 2] = np.searchsorted(before, np.arange(count))
    return core_image(image)
