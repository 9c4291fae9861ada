"""Check a grid's store for missing and damaged data."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass
from typing import Any

from vkbloom._argument_types import check_arguments
from vkbloom._grid.axes import Axis
from vkbloom._grid.keys import Keys, open_keys
from vkbloom._grid.order import GridBlock, blocks
from vkbloom._grid.store import DONE, METADATA, MISSING, Chunks, check_identity
from vkbloom._public import public


@public("vkbloom")
@dataclass(frozen=True)
class GridReport:
    """The result of `check_grid`.

    Parameters
    ----------
    points : int
        Number of points of the grid.
    done : int
        Number of points that are marked as done, including damaged ones.
    problems : tuple of str
        Each damaged or missing key, with the points that it contains.
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


@public("vkbloom")
@check_arguments
def check_grid(store: Any) -> GridReport:
    """Check a grid's store for missing and damaged data, without changing it.

    Parameters
    ----------
    store : str, path-like or zarr.abc.store.Store
        As for `vkbloom.grid`. It may be read-only.

    Returns
    -------
    GridReport
        Every chunk that has points marked as done is read.

    Raises
    ------
    FileNotFoundError
        The store does not exist or is empty.
    ValueError
        The store is not a grid, has another format version, or the group's metadata are damaged.
    OSError
        The store cannot be read.
    """
    keys = open_keys(store)
    held = keys.list_keys()
    if not held:
        raise FileNotFoundError(f"{keys.name}: the store does not exist or is empty")
    identity = check_identity(keys)
    try:
        return _report(identity, keys, held)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{keys.name}: its {METADATA} is damaged: {error}") from error


def _report(identity: Mapping[str, Any], keys: Keys, held: Set[str]) -> GridReport:
    named = identity["axes"]
    axes = [Axis(name, tuple(named[name]), "settings", "", "") for name in named]
    variables = {name: len(variable["shape"]) for name, variable in identity["variables"].items()}
    chunks = Chunks(keys, variables, tuple(identity["chunk"]))
    shape = tuple(map(len, axes))
    arrays = (key.split("/")[0] for key in sorted(held) if re.fullmatch(f"[^/]+/{METADATA}", key))
    problems = [
        f"{problem}, of all points"
        for name in dict.fromkeys((DONE, *variables, *named, *arrays))
        if (problem := chunks.array_problem(name, held))
    ]
    done = 0
    every = [] if problems else list(blocks(shape, chunks.chunk, range(len(shape))))
    for block, told in zip(every, chunks.problems(every, held), strict=True):
        if told[DONE] == MISSING:
            continue
        done += block.count * (told[DONE] is None)
        points = describe(axes, block)
        problems += [
            f"{chunks.key(name, block)} is {problem}, of {points}"
            for name, problem in told.items()
            if problem
        ]
    return GridReport(math.prod(shape), done, tuple(problems))


def describe(axes: Iterable[Axis], block: GridBlock) -> str:
    """Return the points of a block as text: the value, or first and last value, of each axis."""
    parts = []
    for axis, start, stop in zip(axes, block.start, block.stop, strict=True):
        labels = [axis.label(start)] + [axis.label(stop - 1)] * (stop - start > 1)
        parts.append(f"{axis.name}={'..'.join(labels)}")
    return ", ".join(parts) or "the only point"
