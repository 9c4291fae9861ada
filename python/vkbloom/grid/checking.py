"""A grid's store looked through: what is there, what is missing, what is damaged."""

from __future__ import annotations

import json
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vkbloom.checks import import_extra
from vkbloom.grid.axes import Axis
from vkbloom.grid.chunks import check_numbers, check_summed, check_text
from vkbloom.grid.identity import FORMAT, chunk_in, short
from vkbloom.grid.keys import Keys, open_keys
from vkbloom.grid.order import Block, Index, blocks
from vkbloom.grid.plan import Variable
from vkbloom.grid.store import (
    DONE,
    ROOT,
    add_array,
    add_coordinate,
    chunk_key,
    describe,
    done_chunk,
    read_array,
    read_json,
    read_marks,
    reason,
    stored_identity,
)

__all__ = ["GridReport", "check_grid"]

_PURPOSE: Final = "Grids on disk"
# Each is a byte of memory, whatever the file's size.
_MOST_POINTS: Final = 1 << 28
# Of a coordinate that is no axis; of a chunk, before it is compressed.
_MOST_VALUES: Final = 1 << 20
_MOST_BYTES: Final = 1 << 40
_DAMAGE: Final = (ValueError, OSError)
# The data types of coordinates, as Zarr's JSON has them.
_NUMBERS: Final = (
    *("bool", "float16", "float32", "float64"),
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
)
_COORDINATES: Final = {'"string"': "U1", **{f'"{name}"': name for name in _NUMBERS}}
# What an array's metadata say of its shape and its chunks.
_DECISIVE: Final = (
    "zarr_format",
    "node_type",
    "shape",
    "data_type",
    "chunk_grid",
    "chunk_key_encoding",
    "codecs",
    "fill_value",
    "storage_transformers",
)


@dataclass(frozen=True)
class GridReport:
    """What `check_grid` found.

    Parameters
    ----------
    points : int
        Of the grid; 0 where that cannot be told.
    done : int
        Points that are marked as done, the damaged ones among them.
    problems : tuple of str
        What is damaged or missing that should be there, with the points that it holds.
    """

    points: int
    done: int
    problems: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether all points are there, undamaged."""
        return self.points == self.done and not self.problems

    def __str__(self) -> str:
        return "\n".join([f"{self.done} of {self.points} points are done", *self.problems])


def check_grid(store: Any) -> GridReport:
    """Look through a grid's store; nothing in it is changed.

    Parameters
    ----------
    store : str, path-like or zarr.abc.store.Store
        As for `vkbloom.grid_to_zarr`.

    Returns
    -------
    GridReport
        All chunks of points that are marked as done have been read.

    Raises
    ------
    FileNotFoundError
        There is nothing.
    ValueError
        There is something else than a grid, one in another format, or one of over 2**28 points.
    ModuleNotFoundError
        zarr is missing.

    Notes
    -----
    ``grid_to_zarr`` with the arguments that the store was made with mends what it reports.
    """
    keys = open_keys(store)
    held = keys.all()
    if not held:
        raise FileNotFoundError(f"{keys.name}: there is nothing")
    content = keys.read(ROOT)
    root = read_json(content)
    if root is None:
        if not any(key.startswith(f"{DONE}/") for key in held):
            raise ValueError(f"{keys.name}: there is no grid in it")
        return GridReport(0, 0, (f"{_told(ROOT, content)}: it says what the grid is",))
    own = stored_identity(root)
    if own is None:
        raise ValueError(f"{keys.name}: there is no grid in it, but something else")
    if own.get("format") != FORMAT:
        raise ValueError(
            f"{keys.name}: its format is {short(own.get('format'))}, {FORMAT} is known"
        )
    try:
        stored = _read_stored(own, root)
    except (KeyError, TypeError, AttributeError, ValueError):
        return GridReport(0, 0, (f"{_told(ROOT, b'')}: it says what the grid is",))
    if math.prod(stored.shape) > _MOST_POINTS:
        raise ValueError(
            f"{keys.name}: {math.prod(stored.shape)} points are over the most, {_MOST_POINTS}"
        )
    return _looked_through(keys, held, stored)


def _told(key: str, content: bytes | None) -> str:
    return f"{key} is {'missing' if content is None else 'damaged'}"


@dataclass(frozen=True)
class _Stored:
    """What the group's metadata tell of a grid: axes, a block, variables, other coordinates."""

    axes: tuple[Axis, ...]
    chunk: Index
    variables: Mapping[str, Variable]
    coordinates: tuple[str, ...]

    @property
    def shape(self) -> Index:
        return tuple(len(axis) for axis in self.axes)

    @property
    def lengths(self) -> set[int]:
        """What coordinates can have."""
        inner = (size for variable in self.variables.values() for size in variable.shape)
        return {*self.shape, *(size for size in inner if size <= _MOST_VALUES)}


def _read_stored(own: Mapping[str, Any], root: Mapping[str, Any]) -> _Stored:
    """Read an identity; KeyError, TypeError, AttributeError or ValueError if it is none."""
    axes = tuple(
        Axis(name, tuple(own["axes"][name]), "settings", "", "") for name in own["order of axes"]
    )
    chunk = chunk_in(own, tuple(len(axis) for axis in axes))
    if chunk is None:
        raise ValueError
    variables = {}
    for name, told in own["variables"].items():
        shape = tuple(operator.index(size) for size in told["shape"])
        dtype = np.dtype(told["dtype"])
        size = math.prod((*chunk, *shape)) * dtype.itemsize
        if dtype.kind not in "biuf" or size > _MOST_BYTES or min(shape, default=0) < 0:
            raise ValueError
        variables[name] = Variable(("",) * len(shape), shape, dtype, {})
    arrays = root["consolidated_metadata"]["metadata"]
    names = [*arrays, *variables, *(axis.name for axis in axes)]
    # Keys are paths.
    if not all(isinstance(name, str) and re.fullmatch(r"\w[\w.-]*", name) for name in names):
        raise ValueError
    return _Stored(axes, chunk, variables, tuple(sorted({*arrays} - {*variables, DONE})))


def _looked_through(keys: Keys, held: set[str], stored: _Stored) -> GridReport:
    zarr = import_extra("zarr", "grid", _PURPOSE)
    problems: list[str] = []
    sound: dict[str, Variable] = {}
    marks = Variable((), (), np.dtype(np.bool_), {})
    for name in stored.coordinates:
        problems += _coordinate_problems(zarr, keys, held, stored, name)
    for name, variable in {DONE: marks, **stored.variables}.items():
        chunk = done_chunk(stored.shape) if name == DONE else stored.chunk
        dims = tuple(axis.name for axis in stored.axes)
        expected = _made(zarr, add_array, name, variable, (dims, stored.shape, chunk))
        content = keys.read(f"{name}/{ROOT}")
        if _decisive(content) == expected:
            sound[name] = variable
        else:
            problems.append(f"{_told(f'{name}/{ROOT}', content)}, of all points")
    done = np.zeros(stored.shape, np.bool_)
    if sound.pop(DONE, None):
        try:
            done = read_marks(keys, stored.shape)
        except _DAMAGE as error:
            problems.append(f"the marks in {DONE} are damaged ({reason(error)}), of all points")
    for block in blocks(stored.shape, stored.chunk, range(done.ndim)) if done.any() else ():
        if done[block.slices].all():
            found = _block_problems(keys, held, block, stored.chunk, sound)
            problems += [f"{text}, of {describe(stored.axes, block)}" for text in found]
    return GridReport(done.size, int(done.sum()), tuple(problems))


def _made(zarr: Any, add: Callable[..., None], name: str, *arguments: Any) -> dict[str, str] | None:
    """Return what decides how an array is read that is made with some arguments."""
    memory = zarr.storage.MemoryStore()
    add(zarr.open_group(memory, mode="w", zarr_format=3), name, *arguments)
    return _decisive(Keys(memory).read(f"{name}/{ROOT}"))


def _decisive(content: bytes | None) -> dict[str, str] | None:
    """Return what decides how an array is read, None where its metadata are damaged.

    As text, since 3.0 and true are equal to numbers that they cannot stand for.
    """
    metadata = read_json(content)
    if metadata is None or not isinstance(metadata.get("attributes"), dict):
        return None
    try:
        return {key: json.dumps(metadata.get(key), sort_keys=True) for key in _DECISIVE}
    except RecursionError:
        return None


def _coordinate_problems(
    zarr: Any, keys: Keys, held: set[str], stored: _Stored, name: str
) -> list[str]:
    content = keys.read(f"{name}/{ROOT}")
    found = _decisive(content)
    # Any other length than these is none of the grid's.
    sizes = {f"[{size}]": size for size in stored.lengths}
    size = sizes.get(found["shape"]) if found else None
    kind = _COORDINATES.get(found["data_type"]) if found else None
    values = None if size is None or kind is None else np.zeros(size, kind)
    if values is None or found != _made(zarr, add_coordinate, name, values, {}):
        return [f"{_told(f'{name}/{ROOT}', content)}, of all points"]
    if f"{name}/c.0" not in held:
        return [f"the coordinate {name} is missing, of all points"]
    try:
        chunk = keys.read(f"{name}/c.0") or b""
        if values.dtype.kind == "U":
            check_text(chunk, len(values))
        else:
            check_numbers(chunk, values.nbytes)
        read_array(keys, name)
    except _DAMAGE as error:
        return [f"the coordinate {name} is damaged ({reason(error)}), of all points"]
    return []


def _block_problems(
    keys: Keys, held: set[str], block: Block, chunk: Index, variables: Mapping[str, Variable]
) -> Iterator[str]:
    for name, variable in variables.items():
        key = chunk_key(name, block, chunk, len(variable.shape))
        if key not in held:
            yield f"{key} is missing"
            continue
        try:
            check_summed(keys.read(key) or b"", math.prod(chunk) * variable.size)
        except _DAMAGE as error:
            yield f"{key} is damaged ({reason(error)})"
