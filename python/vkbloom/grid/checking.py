"""A grid's store looked through: what is there, what is missing, what is damaged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vkbloom.extras import import_extra
from vkbloom.grid.axes import Axis
from vkbloom.grid.identity import FORMAT
from vkbloom.grid.keys import Keys, open_keys
from vkbloom.grid.order import Block, Index, blocks
from vkbloom.grid.store import DONE, IDENTITY, ROOT, chunk_key, describe, read_json, reason

__all__ = ["GridReport", "check_grid"]


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
        There is something else than a grid, or one in another format.
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
    own = root.get("attributes", {}).get(IDENTITY)
    if own is None:
        raise ValueError(f"{keys.name}: there is no grid in it, but something else")
    if own.get("format") != FORMAT:
        raise ValueError(f"{keys.name}: its format is {own.get('format')!r}, {FORMAT} is known")
    return _looked_through(keys, held, own, root)


def _told(key: str, content: bytes | None) -> str:
    return f"{key} is {'missing' if content is None else 'damaged'}"


def _looked_through(
    keys: Keys, held: set[str], own: Mapping[str, Any], root: Mapping[str, Any]
) -> GridReport:
    zarr = import_extra("zarr", "grid", "Grids on disk")
    axes = [
        Axis(name, tuple(own["axes"][name]), "settings", "", "") for name in own["order of axes"]
    ]
    shape = tuple(len(axis) for axis in axes)
    problems: list[str] = []
    broken: set[str] = set()
    arrays = root.get("consolidated_metadata", {}).get("metadata", {})
    for name in arrays:
        key = f"{name}/{ROOT}"
        content = keys.read(key)
        if read_json(content) is None:
            broken.add(name)
            problems.append(f"{_told(key, content)}, of all points")
    for name in sorted(set(arrays) - broken - set(own["variables"]) - {DONE}):
        problems += _coordinate_problems(zarr, keys, held, name)
    done = np.zeros(shape, np.bool_)
    if DONE not in broken:
        try:
            done = zarr.open_array(keys.store, path=DONE, mode="r")[...]
        except Exception as error:
            problems.append(f"the marks in {DONE} are damaged ({reason(error)}), of all points")
    sound = {
        name: (zarr.open_array(keys.store, path=name, mode="r"), len(variable["shape"]))
        for name, variable in own["variables"].items()
        if name not in broken
    }
    for block in blocks(shape, tuple(own["chunk"]), range(len(shape))):
        if done[block.slices].all():
            found = _block_problems(sound, held, block, tuple(own["chunk"]))
            problems += [f"{text}, of {describe(axes, block)}" for text in found]
    return GridReport(done.size, int(done.sum()), tuple(problems))


def _coordinate_problems(zarr: Any, keys: Keys, held: set[str], name: str) -> list[str]:
    if f"{name}/c.0" not in held:
        return [f"the coordinate {name} is missing, of all points"]
    try:
        zarr.open_array(keys.store, path=name, mode="r")[...]
    except Exception as error:
        return [f"the coordinate {name} is damaged ({reason(error)}), of all points"]
    return []


def _block_problems(
    arrays: Mapping[str, tuple[Any, int]], held: set[str], block: Block, chunk: Index
) -> Iterator[str]:
    for name, (array, trailing) in arrays.items():
        key = chunk_key(name, block, chunk, trailing)
        if key not in held:
            yield f"{key} is missing"
            continue
        try:
            array[block.slices]
        except Exception as error:
            yield f"{key} is damaged ({reason(error)})"
