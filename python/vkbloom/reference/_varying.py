"""Kernels that depend on the place: the exact sum over all pixels, and that of a grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom._psf.places import Size, hat_weights, pixel_places
from vkbloom._psf.resampling import box_resample
from vkbloom._psf.varying import Varying

from ._sampling import Array, size_of
from ._tape import operation, value_of

if TYPE_CHECKING:
    from vkbloom._methods.convolution import Convolution

#: Of an axis: for each pixel the positions, inside and outside of the picture, that show it.
Images = list[list[int]]
#: The convolution of an image with a kernel of its channels, for a boundary.
Convolve = Callable[[Array, Array, str], Array]


def channel_kernels(kernel: Array, channels: int) -> Array:
    """Return the kernels (h, w, channels) of an image's channels, of a kernel (h, w, 3)."""
    mean = kernel.mean(axis=2, keepdims=True)
    colours = kernel if channels in (3, 4) else mean
    return np.concatenate([colours, *[mean] * (channels - colours.shape[2])], axis=2)


def spread_field(glow: Array, settings: Convolution, frame: Size, convolve: Convolve) -> Array:
    """Return the glow, each pixel spread (or collected) by the kernel of its own place."""
    psf = settings.psf
    assert isinstance(psf, Varying)
    buffers = size_of(glow)
    if psf.has_grid:
        return _by_grid(glow, settings, psf, frame, convolve)
    return _by_pixel(glow, psf, settings.boundary, frame, buffers)


def _by_grid(
    glow: Array, settings: Convolution, psf: Varying, frame: Size, convolve: Convolve
) -> Array:
    """Return the sum of the grid's kernels with bilinear weights, before or after them."""
    buffers = size_of(glow)
    kernels = settings.kernel(frame, buffers)
    xs, ys = pixel_places(frame, buffers)
    columns, rows = psf.grid_of(frame)
    across, down = hat_weights(columns, xs), hat_weights(rows, ys)
    result: Any = 0.0
    for j in range(len(rows)):
        for i in range(len(columns)):
            weights = np.outer(down[:, j], across[:, i])[..., np.newaxis]
            kernel = channel_kernels(kernels[j, i], glow.shape[2])
            if psf.gathers:
                result = result + weights * convolve(glow, kernel, settings.boundary)
            else:
                result = result + convolve(weights * glow, kernel, settings.boundary)
    total: Array = result
    return total


def _by_pixel(glow: Array, psf: Varying, boundary: str, frame: Size, buffers: Size) -> Array:
    values = value_of(glow)
    channels = values.shape[2]
    xs, ys = pixel_places(frame, buffers)
    scale = buffers[1] / frame[1], buffers[0] / frame[0]

    def kernel_of(row: int, column: int) -> Array:
        kernel = psf.on_grid(xs[column : column + 1], ys[row : row + 1], frame)[0, 0]
        if buffers != frame:
            kernel = box_resample(kernel, (kernel.shape[0] // 2, kernel.shape[1] // 2), scale)
        return channel_kernels(kernel, channels)

    height, width = kernel_of(0, 0).shape[:2]
    y_images = _images(values.shape[0], height, _mode(boundary, 0))
    x_images = _images(values.shape[1], width, _mode(boundary, 1))
    lines = kernel_of, y_images, x_images, (height, width)
    if not psf.gathers:
        made: Array = operation(_scatter(values, *lines), (glow, lambda d: _gather(d, *lines)))
        return made
    # A pixel and all positions that show it change places.
    mirrored = (lambda row, column: kernel_of(row, column)[::-1, ::-1]), *lines[1:]
    made = operation(_collect(values, *mirrored), (glow, lambda d: _collect_back(d, *mirrored)))
    return made


def _mode(boundary: str, axis: int) -> str:
    if boundary == "wrap_x":
        return ("edge", "wrap")[axis]
    return boundary


def _images(side: int, reach: int, mode: str) -> Images:
    """Return the positions that show each pixel, as far as a kernel of `reach` pixels does."""
    positions: Images = [[] for _ in range(side)]
    for position in range(-reach, side + reach):
        if mode == "wrap":
            positions[position % side].append(position)
        elif mode == "edge":
            positions[min(max(position, 0), side - 1)].append(position)
        elif 0 <= position < side:
            positions[position].append(position)
    return positions


def _pixels(y_images: Images, x_images: Images) -> Iterator[tuple[int, int, list[Size]]]:
    for row, downs in enumerate(y_images):
        for column, acrosses in enumerate(x_images):
            yield row, column, [(y, x) for y in downs for x in acrosses]


def _scatter(
    values: Array,
    kernel_of: Callable[[int, int], Array],
    y_images: Images,
    x_images: Images,
    size: Size,
) -> Array:
    """Return sum over q of x(q) K_q(p - q)."""
    rows, columns = size
    # A position from -rows on has its kernel from -rows - rows // 2 on.
    above, left = rows + rows // 2, columns + columns // 2
    shape = values.shape[0] + 3 * rows, values.shape[1] + 3 * columns, values.shape[2]
    extended = np.zeros(shape)
    for row, column, positions in _pixels(y_images, x_images):
        light = values[row, column] * kernel_of(row, column)
        for y, x in positions:
            top, start = y + above - rows // 2, x + left - columns // 2
            extended[top : top + rows, start : start + columns] += light
    return extended[above : above + values.shape[0], left : left + values.shape[1]].copy()


def _gather(
    derivative: Array,
    kernel_of: Callable[[int, int], Array],
    y_images: Images,
    x_images: Images,
    size: Size,
) -> Array:
    """Return the transpose of `_scatter`: sum over p of y(p) K_q(p - q)."""
    rows, columns = size
    above, left = rows + rows // 2, columns + columns // 2
    extended = np.pad(derivative, ((above, 3 * rows - above), (left, 3 * columns - left), (0, 0)))
    result = np.zeros_like(derivative)
    for row, column, positions in _pixels(y_images, x_images):
        kernel = kernel_of(row, column)
        for y, x in positions:
            top, start = y + above - rows // 2, x + left - columns // 2
            seen = extended[top : top + rows, start : start + columns]
            result[row, column] += (seen * kernel).sum(axis=(0, 1))
    return result


def _collect(
    values: Array,
    mirrored_of: Callable[[int, int], Array],
    y_images: Images,
    x_images: Images,
    size: Size,
) -> Array:
    """Return sum over q of x(q) K_p(p - q), from kernels that are mirrored."""
    rows, columns = size
    shape = values.shape[0] + 2 * rows, values.shape[1] + 2 * columns, values.shape[2]
    extended = np.zeros(shape)
    for row, column, positions in _pixels(y_images, x_images):
        for y, x in positions:
            extended[y + rows, x + columns] = values[row, column]
    result = np.zeros_like(values)
    for row, column, _ in _pixels(y_images, x_images):
        top, left = row + 1 + rows // 2, column + 1 + columns // 2
        seen = extended[top : top + rows, left : left + columns]
        result[row, column] = (seen * mirrored_of(row, column)).sum(axis=(0, 1))
    return result


def _collect_back(
    derivative: Array,
    mirrored_of: Callable[[int, int], Array],
    y_images: Images,
    x_images: Images,
    size: Size,
) -> Array:
    """Return the transpose of `_collect`."""
    rows, columns = size
    height, width, channels = derivative.shape
    extended = np.zeros((height + 2 * rows, width + 2 * columns, channels))
    for row, column, _ in _pixels(y_images, x_images):
        top, left = row + 1 + rows // 2, column + 1 + columns // 2
        light = derivative[row, column] * mirrored_of(row, column)
        extended[top : top + rows, left : left + columns] += light
    result = np.zeros_like(derivative)
    for row, column, positions in _pixels(y_images, x_images):
        for y, x in positions:
            result[row, column] += extended[y + rows, x + columns]
    return result
