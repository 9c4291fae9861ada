"""A grid's store looked through: what is there, what is missing, what is damaged."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vkbloom.grid.axes import Axis
from vkbloom.grid.chunks import check_summed
from vkbloom.grid.identity import FORMAT, chunk_in, short
from vkbloom.grid.keys import Keys, open_keys
from vkbloom.grid.order import Block, Index, blocks
from vkbloom.grid.plan import Variable
from vkbloom.grid.store import (
    DIGESTS,
    DONE,
    ROOT,
    chunk_key,
    describe,
    digest,
    read_json,
    read_marks,
    reason,
    stored_identity,
)

__all__ = ["GridReport", "check_grid"]

_PURPOSE: Final = "Grids on disk"
# Each is a byte of memory, whatever the file's size.
_MOST_POINTS: Final = 1 << 28
# Of a chunk, before it is compressed.
_MOST_BYTES: Final = 1 << 40
_DAMAGE: Final = (ValueError, OSError)


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
    """What the group's metadata tell of a grid: axes, a block, variables, digests by key."""

    axes: tuple[Axis, ...]
    chunk: Index
    variables: Mapping[str, Variable]
    digests: Mapping[str, str]

    @property
    def shape(self) -> Index:
        return tuple(len(axis) for axis in self.axes)


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
    digests = root["attributes"][DIGESTS]
    names = [DONE, *variables, *(axis.name for axis in axes)]
    # Keys are paths.
    if not all(re.fullmatch(r"\w[\w.-]*/[\w.]+", key) for key in digests):
        raise ValueError
    if not all(f"{name}/{ROOT}" in digests for name in names):
        raise ValueError
    return _Stored(axes, chunk, variables, digests)


def _looked_through(keys: Keys, held: set[str], stored: _Stored) -> GridReport:
    problems: list[str] = []
    damaged = set()
    for key, expected in stored.digests.items():
        name, _, rest = key.partition("/")
        # The marks change; their own checksum covers them.
        if name == DONE and rest != ROOT:
            continue
        content = keys.read(key)
        if digest(key, content) == expected:
            continue
        damaged.add(name)
        problems.append(f"{_told(key, content)}, of all points")
    done = np.zeros(stored.shape, np.bool_)
    if DONE not in damaged:
        try:
            done = read_marks(keys, stored.shape)
        except _DAMAGE as error:
            problems.append(f"the marks in {DONE} are damaged ({reason(error)}), of all points")
    sound = {name: held for name, held in stored.variables.items() if name not in damaged}
    for block in blocks(stored.shape, stored.chunk, range(done.ndim)) if done.any() else ():
        if done[block.slices].all():
            found = _block_problems(keys, held, block, stored.chunk, sound)
            problems += [f"{text}, of {describe(stored.axes, block)}" for text in found]
    return GridReport(done.size, int(done.sum()), tuple(problems))


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
