"""Check a grid's store for missing and damaged data."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vkbloom._argument_types import checked
from vkbloom._grid.axes import Axis
from vkbloom._grid.chunks import DONE, Chunks
from vkbloom._grid.identity import fingerprint
from vkbloom._grid.keys import Keys, open_keys
from vkbloom._grid.order import Block, Index, blocks
from vkbloom._grid.store import (
    METADATA,
    PARTS,
    checked_identity,
    mark_of,
    normal,
    read_json,
)


@dataclass(frozen=True)
class GridReport:
    """The result of `check_grid`.

    Parameters
    ----------
    points : int
        Number of points of the grid; 0 if it is not known.
    done : int
        Number of points that are marked as done, including damaged ones.
    problems : tuple of str
        Each damaged or missing key, with the points that it contains.
    missing_parts : tuple of str
        If the grid is rendered in parts: those that are not complete, such as "3/16".
    """

    points: int
    done: int
    problems: tuple[str, ...]
    missing_parts: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether all points are done and nothing is damaged."""
        return self.points == self.done and not self.problems

    def __str__(self) -> str:
        parts = [f"part {part} is not complete" for part in self.missing_parts]
        return "\n".join([f"{self.done} of {self.points} points are done", *parts, *self.problems])


@checked
def check_grid(store: Any) -> GridReport:
    """Check a grid's store for missing and damaged data, without changing it.

    Parameters
    ----------
    store : str, path-like or zarr.abc.store.Store
        As for `vkbloom.grid`.

    Returns
    -------
    GridReport
        Every chunk that has points marked as done is read.

    Raises
    ------
    FileNotFoundError
        The store does not exist or is empty.
    ValueError
        The store is not a grid, or has another format version.
    """
    keys = open_keys(store)
    held = keys.all()
    if not held:
        raise FileNotFoundError(f"{keys.name}: the store does not exist or is empty")
    root = read_json(keys.read(METADATA))
    if root is None and not any(key.startswith(f"{DONE}/") for key in held):
        raise ValueError(f"{keys.name}: its content is not a grid of vkbloom")
    own = None if root is None else checked_identity(root, keys.name)
    arrays = _described_arrays(root or {})
    # ``done`` names the grid, so that a changed identity is found.
    if own is None or fingerprint(own) != mark_of(arrays.get(DONE)):
        return GridReport(0, 0, (f"{_state_of(METADATA, held)}, which describes the grid",))
    return _Stored(keys, held, own, arrays).report()


def _state_of(key: str, held: set[str]) -> str:
    return f"{key} is {'damaged' if key in held else 'missing'}"


def _described_arrays(root: Mapping[str, Any]) -> dict[str, Any]:
    """Return the copy of the arrays' metadata in the group's; empty if it is damaged."""
    copies = root.get("consolidated_metadata")
    found = copies.get("metadata") if isinstance(copies, dict) else None
    # Names become paths in a local store, so they must not leave its folder.
    if not isinstance(found, dict) or not all(re.fullmatch(r"\w[\w.-]*", name) for name in found):
        return {}
    return found


def describe(axes: Iterable[Axis], block: Block) -> str:
    """Return the points of a block as text: the value, or first and last value, of each axis."""
    parts = []
    for axis, start, stop in zip(axes, block.start, block.stop, strict=True):
        labels = [axis.label(start)] + [axis.label(stop - 1)] * (stop - start > 1)
        parts.append(f"{axis.name}={'..'.join(labels)}")
    return ", ".join(parts) or "the only point"


class _Stored:
    """A store whose metadata describe a grid."""

    def __init__(
        self, keys: Keys, held: set[str], own: Mapping[str, Any], arrays: Mapping[str, Any]
    ) -> None:
        self._keys = keys
        self._held = held
        self._arrays = arrays
        self._axes = tuple(
            Axis(name, tuple(own["axes"][name]), "settings", "", "")
            for name in own["order of axes"]
        )
        trailing = {name: len(variable["shape"]) for name, variable in own["variables"].items()}
        self._chunks = Chunks(keys, trailing, tuple(own["chunk"]))

    def report(self) -> GridReport:
        """Read everything."""
        damaged = {name: self._array_problem(name) for name in self._arrays}
        problems = [f"{text}, of all points" for text in damaged.values() if text]
        variables = [name for name in self._chunks.trailing if not damaged.get(name)]
        shape = tuple(map(len, self._axes))
        done = 0
        missing: set[Index] = set()
        for block in blocks(shape, self._chunks.chunk, range(len(shape))):
            if not damaged[DONE]:
                is_done, found = self._block_problems(block, variables)
                done += block.count * is_done
                if not is_done or found:
                    missing.add(block.start)
                problems += [f"{text}, of {describe(self._axes, block)}" for text in found]
        parts = self._missing_parts(shape, missing)
        return GridReport(math.prod(shape), done, tuple(problems), tuple(parts))

    def _missing_parts(self, shape: Index, missing: set[Index]) -> Iterator[str]:
        """Yield the parts that have a missing or damaged block, by the blocks' first points."""
        for key in sorted(self._held):
            if not key.startswith(PARTS):
                continue
            try:
                count = int(key.removeprefix(PARTS))
                ranking = json.loads(self._keys.read(key) or b"")
            except ValueError:
                continue
            if count < 1 or not isinstance(ranking, list):
                continue
            if sorted(map(str, ranking)) != sorted(map(str, range(len(shape)))):
                continue
            for number in range(1, count + 1):
                own = blocks(shape, self._chunks.chunk, ranking, (number, count))
                if any(block.start in missing for block in own):
                    yield f"{number}/{count}"

    def _array_problem(self, name: str) -> str | None:
        """Return what is wrong with the metadata of an array, or with a coordinate."""
        key = f"{name}/{METADATA}"
        copy = json.dumps(self._arrays[name]).encode()
        if normal(key, self._keys.read(key)) != normal(key, copy):
            return _state_of(key, self._held)
        if name == DONE or name in self._chunks.trailing:
            return None
        chunks = Chunks(self._keys, {}, (1,))
        values = Block((0,), tuple(self._arrays[name]["shape"]), (False,))
        problem = chunks.problem(name, values, self._held)
        return None if problem is None else f"{chunks.key(name, values)} is {problem}"

    def _block_problems(self, block: Block, variables: Iterable[str]) -> tuple[bool, list[str]]:
        marked = self._chunks.marked(block, self._held)
        if isinstance(marked, str):
            return False, [f"{self._chunks.key(DONE, block)} is {marked}"]
        found = []
        for name in variables if marked else ():
            problem = self._chunks.problem(name, block, self._held)
            if problem is not None:
                found.append(f"{self._chunks.key(name, block)} is {problem}")
        return marked, found
