"""A contact sheet of a grid: one picture per point, in rows and columns by axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import MAPPING, checked_as
from vkbloom._checks import check_index
from vkbloom._framebuffers import leading
from vkbloom._grid import selection
from vkbloom._views import pictures

if TYPE_CHECKING:
    import xarray

__all__ = ["contact_sheet"]

_BACKGROUND: Final = 24
_CELL: Final = 40
# Width of a character relative to the font size; OpenImageIO's font is about half as wide as high.
_LETTER_WIDTH: Final = 0.6


@checked_as(at=MAPPING)
def contact_sheet(
    dataset: xarray.Dataset,
    rows: str | None = None,
    columns: str | None = None,
    *,
    framebuffer: str | None = None,
    at: Mapping[str, Any] | None = None,
    width: int = 160,
    most: int = 12,
) -> bytes:
    """Return a labelled contact sheet of a grid as a PNG file.

    Parameters
    ----------
    dataset : xarray.Dataset
        A grid from `vkbloom.grid` or `vkbloom.grid`, a store opened by xarray, or
        a selection of one. Points that are not done are shown as empty cells.
    rows, columns : str, optional
        The vertical and the horizontal axis. Default: the last two axes that have more than one
        value, the last one horizontal.
    framebuffer : str, optional
        The framebuffer to show. Default: ``final``, or else the last framebuffer.
    at : mapping of str to object, optional
        Values of the other axes: the nearest number is selected, or an equal text. Default: their
        first values. The sheet's title lists them.
    width : int
        Width of a picture in pixels, 48 to 4096. Pictures are reduced by averaging, and enlarged
        by repeating pixels.
    most : int
        Largest number of pictures in a row or column, 1 to 64; of a longer axis, evenly spaced
        values are shown.

    Returns
    -------
    bytes
        An 8-bit RGB PNG file. 8-bit frames are shown unchanged. Float frames are clipped to 0..1
        and encoded to sRGB, unless the settings have an encoding.

    Raises
    ------
    TypeError, ValueError
        The Dataset is not a grid or has no framebuffers, or an argument is wrong.

    Examples
    --------
    >>> image = np.zeros((16, 16, 4), np.uint8)
    >>> image[8, 8] = 255
    >>> with vkbloom.Renderer("software") as renderer:
    ...     grid = vkbloom.grid(
    ...         image,
    ...         vkbloom.Separable(),
    ...         {"blur_scale": [1.0, 2.0], "loops": [1, 2]},
    ...         renderer=renderer,
    ...     )
    >>> sheet = vkbloom.contact_sheet(grid, width=64)
    >>> sheet[1:4]
    b'PNG'
    """
    width = check_index("width", width, 48, 4096)
    most = check_index("most", most, 1, 64)
    rows, columns = _shown(dataset, rows, columns)
    name = _framebuffer(dataset, framebuffer)
    shown = [axis for axis in (rows, columns) if axis is not None]
    part = selection.select(dataset, at, shown)
    part = selection.thinned(selection.thinned(part, rows, most), columns, most)
    down, across = (
        range(part.sizes[axis]) if axis is not None else range(1) for axis in (rows, columns)
    )
    height, length = _frame_size(part, name, shown)
    size = pictures.scaled(length, height, width / length)
    texts: list[tuple[int, int, str]] = []
    letter = max(11, width // 14)
    gap = letter // 2
    row_labels = [_heading(part, rows, row) for row in down]
    left = gap + round(_LETTER_WIDTH * letter * max(map(len, row_labels)))
    top = 3 * letter + gap
    sheet = np.full(
        (
            top + len(down) * (size[1] + gap) + gap,
            left + gap + len(across) * (size[0] + gap) + gap,
            3,
        ),
        _BACKGROUND,
        np.uint8,
    )
    headings = [_heading(part, columns, column) for column in across]
    title = [name, selection.caption(part)]
    if max(map(len, headings)) * _LETTER_WIDTH * letter > size[0]:
        # Narrow columns show the values only; the title names the axis.
        headings = [text.partition("=")[2] for text in headings]
        title.insert(1, f"{columns} across")
    texts.append((gap, letter + gap, ", ".join(filter(None, title))))
    for column in across:
        x = left + gap + column * (size[0] + gap)
        texts.append((x, top - gap, headings[column]))
        for row in down:
            y = top + row * (size[1] + gap)
            cell = _cell(part, {rows: row, columns: column}, name, size)
            sheet[y : y + size[1], x : x + size[0]] = cell
    for row, text in enumerate(row_labels):
        texts.append((gap, top + row * (size[1] + gap) + size[1] // 2, text))
    return pictures.png(pictures.labelled(sheet, texts, letter))


def _shown(
    dataset: xarray.Dataset, rows: str | None, columns: str | None
) -> tuple[str | None, str | None]:
    """Return the vertical and the horizontal axis."""
    axes = selection.axes_of(dataset)
    for field, name in (("rows", rows), ("columns", columns)):
        if name is not None and name not in axes:
            raise ValueError(
                f"{field}: {name!r} is not an axis of the grid; it has {', '.join(axes)}"
            )
    if rows is not None and rows == columns:
        raise ValueError(f"rows: {rows!r} is already the horizontal axis; name another")
    free = [name for name in axes if dataset.sizes[name] > 1 and name not in (rows, columns)]
    if columns is None:
        columns = free.pop() if free else None
    if rows is None:
        rows = free.pop() if free else None
    return rows, columns


def _framebuffer(dataset: xarray.Dataset, framebuffer: str | None) -> str:
    """Return the framebuffer to show."""
    found = {
        name: np.empty((0,) * dims) for name, dims in selection.framebuffers_of(dataset).items()
    }
    if not found:
        raise ValueError("dataset: the grid has no framebuffers to show")
    if framebuffer is None:
        return leading(found)
    if framebuffer not in found:
        raise ValueError(f"framebuffer: {framebuffer!r} is not one of {', '.join(found)}")
    return framebuffer


def _frame_size(part: xarray.Dataset, name: str, shown: list[str]) -> tuple[int, int]:
    """Return height and width of a framebuffer."""
    sizes = [part[name].sizes[dim] for dim in part[name].dims if dim not in shown]
    return sizes[0], sizes[1]


def _heading(part: xarray.Dataset, axis: str | None, place: int) -> str:
    if axis is None:
        return ""
    return f"{axis}={selection.label(part[axis].values[place])}"


def _cell(
    part: xarray.Dataset, place: Mapping[str | None, int], name: str, size: tuple[int, int]
) -> NDArray[np.uint8]:
    point = part.isel({axis: number for axis, number in place.items() if axis is not None})
    if "done" in point and not bool(point["done"].values):
        return np.full((size[1], size[0], 3), _CELL, np.uint8)
    is_encoded = name == "final" and selection.encoding_of(point) != "none"
    picture = pictures.picture(point[name].values, name, encoded=is_encoded, size=size)
    return np.broadcast_to(picture[:, :, :3], (size[1], size[0], 3))
