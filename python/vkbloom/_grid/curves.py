"""Plot figures of a grid along one axis, with a line for each value of another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom._argument_types import MAPPING, checked_as
from vkbloom._checks import import_extra
from vkbloom._grid import selection

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

__all__ = ["response_curves"]

_WIDTH, _HEIGHT = 6.4, 3.2  # inches of one diagram


@checked_as(at=MAPPING)
def response_curves(
    dataset: xarray.Dataset,
    axis: str | None = None,
    lines: str | None = None,
    *,
    variables: Sequence[str] | None = None,
    at: Mapping[str, Any] | None = None,
    most: int = 8,
) -> Figure:
    """Plot figures of a grid along an axis.

    Parameters
    ----------
    dataset : xarray.Dataset
        A grid from `vkbloom.grid` or `vkbloom.grid`, a store opened by xarray, or
        a selection of one.
    axis : str, optional
        The horizontal axis. Default: the numeric axis with the most values.
    lines : str, optional
        The axis with a line for each of its values. Default: the next axis with more than one
        value, or the dimension of a figure that is an array, such as an encircled energy.
    variables : sequence of str, optional
        The variables to plot, one diagram each. Default: all variables that are not framebuffers;
        if there are none, the mean of red, green and blue of each framebuffer.
    at : mapping of str to object, optional
        Values of the other axes: the nearest number is selected, or an equal text. Default: their
        first values.
    most : int
        Largest number of lines in a diagram; of more values, evenly spaced ones are shown.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with ``savefig``; a notebook shows it. Points that are not done are left out.

    Raises
    ------
    TypeError, ValueError
        The Dataset is not a grid, or an argument is wrong.
    ModuleNotFoundError
        matplotlib is missing.

    Examples
    --------
    >>> from vkbloom._grid.reductions import Mean
    >>> image = np.full((16, 16, 4), 0.5, np.float32)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     grid = vkbloom.grid(
    ...         image,
    ...         axes={"intensity": [0.5, 1.0]},
    ...         framebuffers=(),
    ...         reduce={"mean": Mean()},
    ...         renderer=renderer,
    ...     )
    >>> figure = vkbloom.response_curves(grid)
    >>> [diagram.get_xlabel() for diagram in figure.axes]
    ['intensity']
    """
    figure_module = import_extra("matplotlib.figure", "grid", "response_curves")
    axes = selection.axes_of(dataset)
    for field, chosen in (("axis", axis), ("lines", lines)):
        if chosen is not None and chosen not in axes:
            raise ValueError(
                f"{field}: {chosen!r} is not an axis of the grid; it has {', '.join(axes)}"
            )
    if axis is None:
        long = [name for name in axes if name != lines and dataset.sizes[name] > 1]
        if not long:
            raise ValueError("dataset: no axis of the grid has more than one value")
        # Numeric axes first; among them the longest.
        axis = max(long, key=lambda name: (_is_number(dataset, name), dataset.sizes[name]))
    if axis == lines:
        raise ValueError(f"lines: {lines!r} is already the horizontal axis; name another")
    figures = _figures(dataset, variables, axes)
    figure: Figure = figure_module.Figure(
        figsize=(_WIDTH, _HEIGHT * len(figures)), layout="constrained"
    )
    diagrams = figure.subplots(len(figures), 1, squeeze=False)[:, 0]
    for diagram, (name, values) in zip(diagrams, figures.items(), strict=True):
        _draw(diagram, dataset, values.rename(name), (axis, lines), (at, most))
    return figure


def _is_number(dataset: xarray.Dataset, name: str) -> bool:
    return dataset[name].dtype.kind in "iuf"


def _figures(
    dataset: xarray.Dataset, variables: Sequence[str] | None, axes: Sequence[str]
) -> dict[str, xarray.DataArray]:
    """Return the figures to plot, by their labels."""
    frames = list(selection.framebuffers_of(dataset))
    others = [str(name) for name in dataset.data_vars if name not in (*frames, "done")]
    chosen = list(others or frames) if variables is None else list(variables)
    found = {}
    for name in chosen:
        if name not in (*frames, *others):
            raise ValueError(f"variables: {name!r} is not one of {', '.join((*others, *frames))}")
        array = dataset[name]
        if name in frames:
            channel = [dim for dim in array.dims if str(dim).endswith("channel")]
            scale = 255 if array.dtype == np.uint8 else 1
            colours = array.isel({dim: slice(0, 3) for dim in channel})
            kept = [dim for dim in array.dims if dim not in axes]
            array = colours.mean(kept, dtype=np.float64) / scale
            name = f"mean of {name}"  # noqa: PLW2901  the label of the figure
        if "done" in dataset:
            array = array.where(dataset["done"])
        array.attrs = dict(dataset[name].attrs) if name in others else {}
        found[name] = array
    return found


def _draw(
    diagram: Any,
    dataset: xarray.Dataset,
    values: xarray.DataArray,
    named: tuple[str, str | None],
    chosen: tuple[Mapping[str, Any] | None, int],
) -> None:
    axis, lines = named
    at, most = chosen
    own = [str(dim) for dim in values.dims if dim not in selection.axes_of(dataset)]
    if len(own) > 1:
        raise ValueError(f"variables: {values.name} has {len(own)} dimensions besides the axes")
    if lines is None and not own:
        free = [d for d in selection.axes_of(dataset) if d not in (axis, *(at or {}))]
        lines = next((name for name in reversed(free) if dataset.sizes[name] > 1), None)
    across = own[0] if lines is None and own else lines
    # A Dataset keeps the coordinates of the axes that are not shown.
    table = dataset.drop_vars(list(dataset.data_vars)).assign(value=values)
    shown = [name for name in (axis, lines) if name is not None]
    part = selection.select(table, at, shown)
    if own and across != own[0]:
        part = part.isel({own[0]: 0})
    part = selection.thinned(part, across, most)
    coordinate = part[axis].values
    x: Any = (
        coordinate
        if _is_number(dataset, axis)
        else [selection.label(value) for value in coordinate]
    )
    for place in range(part.sizes[across] if across else 1):
        line = part["value"].isel({across: place}) if across else part["value"]
        label = f"{across}={selection.label(part[across].values[place])}" if across else None
        diagram.plot(x, line.transpose(axis).values, marker=".", label=label)
    unit = dataset[axis].attrs.get("units", "1")
    diagram.set_xlabel(axis if unit in ("1", "") else f"{axis} ({unit})")
    unit = values.attrs.get("units", "1")
    diagram.set_ylabel(str(values.name) if unit == "1" else f"{values.name} ({unit})")
    diagram.set_title(selection.caption(part), fontsize="small")
    diagram.grid(alpha=0.3)
    if across:
        # Beside the diagram, so that it hides no line.
        diagram.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1, 1))
