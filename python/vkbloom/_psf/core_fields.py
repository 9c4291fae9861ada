"""The weights of a field of kernels, for the core."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._array_cache import keep
from vkbloom._core_kernel import CoreKernel, core_image
from vkbloom._psf.places import Size, pixel_places, places_before
from vkbloom._psf.varying import Varying

#: Of the image of weights, where one grid is not wider.
_WIDTH: Final = 4096


def core_field(psf: Varying, frame: Size, buffers: Size) -> tuple[Any, ...] | None:
    """Return a field as the core reads it; None if its only kernel has no weights.

    - The number of kernels, and whether they gather.
    - Whether the weight of the first kernel is 1.
    - Columns and rows of the grid of weights.
    - Images of the weights and of the buffers' places in the grid.
    """
    made = psf.components(frame)
    unweighted = bool((made.weights[0] == 1).all())
    if len(made.kernels) == 1 and unweighted:
        return None
    rows, columns = made.weights.shape[1:]
    places = _places(psf, frame, buffers)
    return (len(made.kernels), psf.gathers, unweighted, columns, rows, _weights(psf, frame), places)


@keep
def _weights(psf: Varying, frame: Size) -> CoreKernel:
    """Return the weights, four in each texel: grids side by side and below each other."""
    weights = psf.components(frame).weights
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
    """Return the place before each column, then each row, and the share of the next place."""
    made = psf.components(frame)
    image: NDArray[np.float32] = np.zeros((2, max(buffers), 4), np.float32)
    for line, nodes, at in zip(
        image, (made.xs, made.ys), pixel_places(frame, buffers), strict=True
    ):
        line[: len(at), 0], line[: len(at), 1] = places_before(nodes, at)
    return core_image(image)
