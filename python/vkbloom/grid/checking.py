"""Check a grid's store for missing and damaged data."""

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
from vkbloom.grid.identity import chunk_in
from vkbloom.grid.keys import Keys, open_keys
from vkbloom.grid.order import Block, Index, blocks
from vkbloom.grid.plan import Variable
from vkbloom.grid.store import (
    DIGESTS,
    DONE,
    ROOT,
    checked_identity,
    chunk_key,
    describe,
    digest,
    read_json,
    read_marks,
    reason,
)

__all__ = ["GridReport", "check_grid"]

_PURPOSE: Final = "Grids on disk"
# The marks take one byte of memory per point, even if the compressed file is small.
_MOST_POINTS: Final = 1 << 28
# Largest size of an uncompressed chunk.
_MOST_BYTES: Final = 1 << 40
_DAMAGE: Final = (ValueError, OSError)


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

    See Also
    --------
    check_grid : Returns it.

    Examples
    --------
    >>> report = vkbloom.GridReport(points=4, done=3, problems=())
    >>> report.complete
    False
    >>> print(report)
    3 of 4 points are done
    """

    points: int
    done: int
    problems: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether all points are done and nothing is damaged."""
        return self.points == self.done and not self.problems

    def __str__(self) -> str:
        return "\n".join([f"{self.done} of {self.points} points are done", *self.problems])


def check_grid(store: Any) -> GridReport:
    """Check a grid's store for missing and damaged data, without changing it.

    Parameters
    ----------
    store : str, path-like or zarr.abc.store.Store
        As for `vkbloom.grid_to_zarr`.

    Returns
    -------
    GridReport
        Every chunk that has points marked as done is read.

    Raises
    ------
    FileNotFoundError
        The store does not exist or is empty.
    ValueError
        The store is not a grid, has another format version, or has over 2**28 points.
    ModuleNotFoundError
        zarr is missing.

    See Also
    --------
    grid_to_zarr : Renders a grid, and repairs one: call it with the arguments of the first call.

    Examples
    --------
    >>> import zarr
    >>> image = np.zeros((16, 16, 4), np.uint8)
    >>> store = zarr.storage.MemoryStore()
    >>> grid = vkbloom.grid_to_zarr(
    ...     image, None, {"intensity": [0.5, 1.0]}, store, adapter="software"
    ... )
    >>> print(vkbloom.check_grid(store))
    2 of 2 points are done
    """
    keys = open_keys(store)
    held = keys.all()
    if not held:
        raise FileNotFoundError(f"{keys.name}: the store does not exist or is empty")
    content = keys.read(ROOT)
    root = read_json(content)
    if root is None:
        if not any(key.startswith(f"{DONE}/") for key in held):
            raise ValueError(f"{keys.name}: its content is not a grid of vkbloom")
        return GridReport(0, 0, (f"{_state_of(ROOT, content)}, which describes the grid",))
    own = checked_identity(root, keys.name)
    try:
        stored = _read_stored(own, root)
    except (KeyError, TypeError, AttributeError, ValueError):
        return GridReport(0, 0, (f"{_state_of(ROOT, b'')}, which describes the grid",))
    if math.prod(stored.shape) > _MOST_POINTS:
        raise ValueError(
            f"{keys.name}: the number of points, {math.prod(stored.shape)}, is not within "
            f"{_MOST_POINTS}"
        )
    return _checked(keys, held, stored)


def _state_of(key: str, content: bytes | None) -> str:
    return f"{key} is {'missing' if content is None else 'damaged'}"


@dataclass(frozen=True)
class _Stored:
    """A grid as the group's metadata describe it: axes, chunk, variables, digests by key."""

    axes: tuple[Axis, ...]
    chunk: Index
    variables: Mapping[str, Variable]
    digests: Mapping[str, str]

    @property
    def shape(self) -> Index:
        return tuple(len(axis) for axis in self.axes)


def _read_stored(own: Mapping[str, Any], root: Mapping[str, Any]) -> _Stored:
    """Parse a stored identity.

    Raises
    ------
    KeyError, TypeError, AttributeError, ValueError
        It is damaged.
    """
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
    # Keys become paths in a local store, so they must not leave its folder.
    if not all(re.fullmatch(r"\w[\w.-]*/[\w.]+", key) for key in digests):
        raise ValueError
    if not all(f"{name}/{ROOT}" in digests for name in names):
        raise ValueError
    return _Stored(axes, chunk, variables, digests)


def _checked(keys: Keys, held: set[str], stored: _Stored) -> GridReport:
    problems: list[str] = []
    damaged = set()
    for key, expected in stored.digests.items():
        name, _, rest = key.partition("/")
        # The marks change while the grid is rendered; their own checksums cover them.
        if name == DONE and rest != ROOT:
            continue
        content = keys.read(key)
        if digest(key, content) == expected:
            continue
        damaged.add(name)
        problems.append(f"{_state_of(key, content)}, of all points")
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
