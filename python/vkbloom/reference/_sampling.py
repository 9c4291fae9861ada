"""Sizes of images and of their levels, and bilinear sampling, clamped to the edge.

All passes of the bloom methods read at positions that form a grid: the pixel centres of the
image they write, moved by the offset of a tap. Bilinear interpolation and clamping are separable,
so a pass (or a term of it) is one matrix for the rows and one for the columns. The matrices are
banded. They are built and applied in blocks of output rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ._tape import Traced, contiguous, operation, value_of

Array = NDArray[np.float64]

# (offset in texels of the image that is read, weight) of each tap along one axis.
Taps = Sequence[tuple[float, float]]

CENTRE: Taps = ((0.0, 1.0),)

# Output rows per block: enough for fast matrix products, and few enough that a block of a large
# image has few zeros beside its band.
_BLOCK = 32


#: The widest level of a method that gives its levels a height and the aspect of the frame.
WIDEST_LEVEL: Final = 16384


def size_of(image: Any) -> tuple[int, int]:
    """Return width and height of an image."""
    return image.shape[1], image.shape[0]


def halve_size(size: tuple[int, int], more: int = 0) -> tuple[int, int]:
    """Return half of a size, each side floored but at least 1; `more`: 1 to round up."""
    return max(1, (size[0] + more) // 2), max(1, (size[1] + more) // 2)


def scale_size(size: tuple[int, int], scale: float) -> tuple[int, int]:
    """Return a size times a factor, each side floored but at least 1."""
    return max(1, math.floor(size[0] * scale)), max(1, math.floor(size[1] * scale))


def level_sizes(size: tuple[int, int], levels: int) -> list[tuple[int, int]]:
    """Return the sizes of the levels below an image, largest first.

    Each level has half the size of the one before (`halve_size`). The chain ends before a level of
    1 x 1, except that it always has one level.
    """
    sizes: list[tuple[int, int]] = []
    for _ in range(levels):
        size = halve_size(size)
        if sizes and size == (1, 1):
            break
        sizes.append(size)
    return sizes


def sample(
    image: Array, size: tuple[int, int], x_taps: Taps = CENTRE, y_taps: Taps = CENTRE
) -> Array:
    """Sample an image with taps around the pixel centres of another one, and add them.

    The pixel (i, j) of the result has its centre at ((i + 0.5) / width, (j + 0.5) / height) in
    normalized coordinates. In an image with w texels in a row, whose texel n is at position n, this
    is (i + 0.5) / width * w - 0.5 texels. Between texels the value is the linear interpolation
    of the two nearest texels along each axis (the Vulkan specification, chapter "Image Operations",
    section "Texel Filtering", of linear filters). Outside of the image it is the value at the edge.
    """
    width, height = size
    rows = _filter_rows(image, height, y_taps)
    columns = _filter_rows(rows.swapaxes(0, 1), width, x_taps)
    return contiguous(columns.swapaxes(0, 1))


def box(image: Array, size: tuple[int, int], distance: float = 1.0) -> Array:
    """Return the mean of four samples at a distance along both axes, in texels of the image."""
    taps = ((-distance, 0.5), (distance, 0.5))
    return sample(image, size, taps, taps)


def _filter_rows(image: Array, count: int, taps: Taps) -> Array:
    """Apply the taps along the first axis, for `count` rows of output."""
    values, offsets, shares = value_of(image), *zip(*taps, strict=True)
    positions = np.array([value_of(offset) for offset in offsets], dtype=np.float64)
    weights = np.array([value_of(share) for share in shares], dtype=np.float64)
    length = values.shape[0]
    is_traced = any(isinstance(value, Traced) for value in (*offsets, *shares))
    if count == length and tuple(taps) == CENTRE and not is_traced:
        return image
    source = values.reshape(length, -1)
    blocks = _bands(length, count, positions, weights)
    result = np.concatenate([matrix @ source[texels] for _, texels, matrix in blocks])

    def by_image(derivative: Array) -> Array:
        total: Array = np.zeros(source.shape)
        for rows, texels, matrix in _bands(length, count, positions, weights):
            total[texels] += matrix.T @ derivative[rows].reshape(len(matrix), -1)
        return total.reshape(values.shape)

    def by_weight(tap: int) -> Callable[[Array], Array]:
        alone = ((float(positions[tap]), 1.0),)
        return lambda derivative: (derivative * _filter_rows(values, count, alone)).sum()

    def by_offset(tap: int) -> Callable[[Array], Array]:
        return lambda derivative: (
            weights[tap] * (derivative * _slopes(values, count, positions[tap])).sum()
        )

    filtered: Array = operation(
        result.reshape(count, *values.shape[1:]),
        (image, by_image),
        *((share, by_weight(tap)) for tap, share in enumerate(shares)),
        *((offset, by_offset(tap)) for tap, offset in enumerate(offsets)),
    )
    return filtered


def _bands(
    length: int, count: int, offsets: Array, tap_weights: Array
) -> Iterator[tuple[slice, slice, Array]]:
    """Yield blocks of output rows, the texels that each reads, and the matrix between them."""
    for start in range(0, count, _BLOCK):
        stop = min(start + _BLOCK, count)
        centres = (np.arange(start, stop) + 0.5) * length / count - 0.5
        positions = centres[:, np.newaxis] + offsets
        lower = np.floor(positions)
        fraction = positions - lower
        texels = np.clip(np.stack([lower, lower + 1]), 0, length - 1).astype(np.intp)
        weights = np.stack([1 - fraction, fraction]) * tap_weights

        first = int(texels.min())
        band = int(texels.max()) + 1 - first
        output_rows = np.arange(stop - start)[:, np.newaxis]
        # bincount adds up taps at the same texel.
        matrix = np.bincount(
            (output_rows * band + texels - first).ravel(),
            weights=weights.ravel(),
            minlength=(stop - start) * band,
        )
        blocks = slice(start, stop), slice(first, first + band)
        yield *blocks, matrix.reshape(stop - start, band).astype(np.float64, copy=False)


def _slopes(image: Array, count: int, offset: float) -> Array:
    """Return the derivative of a tap by its offset: at texel centres the mean of both sides."""
    length = image.shape[0]
    positions = (np.arange(count) + 0.5) * length / count - 0.5 + offset
    # A centre is met with roundings.
    left, right = np.ceil(positions - 1e-9) - 1, np.floor(positions + 1e-9)
    texels = [
        image[np.clip(texel, 0, length - 1).astype(np.intp)]
        for texel in (left, left + 1, right, right + 1)
    ]
    slopes: Array = (texels[1] - texels[0] + texels[3] - texels[2]) / 2
    return slopes


def read_rows(image: Array, positions: Array) -> Array:
    """Sample an image along its first axis at any positions, linearly and clamped to the edge."""
    lower = np.floor(positions)
    part = (positions - lower)[:, np.newaxis, np.newaxis]
    first, second = (
        image[np.clip(lower + i, 0, image.shape[0] - 1).astype(np.intp)] for i in (0, 1)
    )
    rows: Array = (1 - part) * first + part * second
    return rows


def weighted_mean(parts: Iterable[tuple[Array | float, Array]]) -> Array:
    """Return the weighted mean of images."""
    total, weights = np.zeros(()), np.zeros(())
    for weight, image in parts:
        total = total + weight * image
        weights = weights + weight
    mean: Array = total / weights
    return mean
