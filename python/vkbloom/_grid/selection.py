"""Select a part of a grid to show: the shown axes, and one value of each other axis."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

__all__ = [
    "axes_of",
    "caption",
    "encoding_of",
    "framebuffers_of",
    "label",
    "places",
    "select",
    "thinned",
]


def axes_of(dataset: xarray.Dataset) -> list[str]:
    """Return the axes of a grid that are still dimensions of the Dataset."""
    if not hasattr(dataset, "data_vars"):
        raise TypeError(f"dataset: {type(dataset).__name__} is not an xarray.Dataset")
    if "axes" not in dataset.attrs:
        raise ValueError("dataset: its attributes have no 'axes', so it is not a grid of vkbloom")
    return [name for name in json.loads(dataset.attrs["axes"]) if name in dataset.dims]


def framebuffers_of(dataset: xarray.Dataset) -> dict[str, int]:
    """Return the framebuffers of a grid, with the number of dimensions of a frame."""
    found = {}
    for name, array in dataset.data_vars.items():
        own = [str(dim).rpartition("_")[2] for dim in array.dims]
        if {"y", "x"} <= set(own):
            found[str(name)] = 3 if "channel" in own else 2
    return found


def select(
    dataset: xarray.Dataset, at: Mapping[str, Any] | None, shown: Sequence[str]
) -> xarray.Dataset:
    """Reduce a grid to the shown axes."""
    axes = axes_of(dataset)
    for name in at or {}:
        if name not in axes:
            raise ValueError(f"at: {name!r} is not an axis of the grid; it has {', '.join(axes)}")
        if name in shown:
            raise ValueError(f"at: {name!r} is a shown axis; leave it out")
    for name in axes:
        if name in (at or {}):
            dataset = dataset.isel({name: _place(name, dataset[name].values, (at or {})[name])})
        elif name not in shown:
            dataset = dataset.isel({name: 0})
    return dataset


def _place(name: str, values: NDArray[Any], value: Any) -> int:
    """Return the index that `select` takes along an axis."""
    is_text = values.dtype.kind not in "biuf"
    is_number = isinstance(value, Real)
    if value is None or (is_number and math.isnan(value)):
        fits = values == "none" if is_text else np.isnan(values)
    elif is_number and math.isfinite(value) and values.dtype.kind in "iuf":
        # xarray's own nearest selection needs sorted values, and no NaN (which stands for None).
        distances = np.abs(values - float(value))
        fits = distances == np.nanmin(distances)
    else:
        fits = values == value if np.ndim(value) == 0 else np.zeros(values.shape, np.bool_)
    if not fits.any():
        raise ValueError(f"at: {name} has no value {value!r}")
    return int(fits.argmax())


def label(value: Any) -> str:
    """Return a coordinate's value as a short text."""
    plain = value.item() if hasattr(value, "item") else value
    return f"{plain:.4g}" if isinstance(plain, float) else str(plain)


def caption(dataset: xarray.Dataset) -> str:
    """Return the selected values of the axes that are not shown."""
    names = (name for name in json.loads(dataset.attrs["axes"]) if name not in dataset.dims)
    return ", ".join(f"{name}={label(dataset[name].values[()])}" for name in names)


def places(count: int, most: int) -> list[int]:
    """Return at most `most` indices, evenly spaced over `count`, both ends included."""
    if count <= most:
        return list(range(count))
    return [int(place) for place in np.linspace(0, count - 1, most).round()]


def thinned(dataset: xarray.Dataset, axis: str | None, most: int) -> xarray.Dataset:
    """Keep at most `most` values of an axis."""
    if axis is None:
        return dataset
    return dataset.isel({axis: places(dataset.sizes[axis], most)})


def encoding_of(dataset: xarray.Dataset) -> str:
    """Return the encoding of one grid point."""
    if "encoding" in dataset.coords:
        return str(dataset["encoding"].values[()])
    return str(json.loads(dataset.attrs.get("settings", "{}")).get("encoding", "none"))
