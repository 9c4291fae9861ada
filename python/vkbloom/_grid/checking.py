"""Check a grid's store for missing and damaged data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vkbloom._argument_types import checked
from vkbloom._grid.axes import Axis
from vkbloom._grid.order import Block, blocks
from vkbloom._grid.store import (
    DONE,
    METADATA,
    MISSING,
    Chunks,
    checked_identity,
    folder_of,
    is_empty,
)
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
@checked
def check_grid(store: Any) -> GridReport:
    """Check a grid's store for missing and damaged data, without changing it.

    Parameters
    ----------
    store : str or path-like
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
        The store is not a grid, has another format version, or the group's metadata are damaged.
    """
    folder = folder_of(store)
    if is_empty(folder):
        raise FileNotFoundError(f"{folder}: the store does not exist or is empty")
    identity = checked_identity(folder)
    try:
        return _report(identity, folder)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{folder}: its {METADATA} is damaged: {error}") from error


def _report(identity: Mapping[str, Any], folder: Path) -> GridReport:
    named = identity["axes"]
    axes = [Axis(name, tuple(named[name]), "settings", "", "") for name in named]
    variables = {name: len(variable["shape"]) for name, variable in identity["variables"].items()}
    chunks = Chunks(folder, variables, tuple(identity["chunk"]))
    shape = tuple(map(len, axes))
    there = (file.parent.name for file in sorted(folder.glob(f"*/{METADATA}")))
    problems = [
        f"{problem}, of all points"
        for name in dict.fromkeys((DONE, *variables, *named, *there))
        if (problem := chunks.array_problem(name))
    ]
    done = 0
    for block in blocks(shape, chunks.chunk, range(len(shape))) if not problems else ():
        told = {name: chunks.problem(name, block) for name in (DONE, *variables)}
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


def describe(axes: Iterable[Axis], block: Block) -> str:
    """Return the points of a block as text: the value, or first and last value, of each axis."""
    parts = []
    for axis, start, stop in zip(axes, block.start, block.stop, strict=True):
        labels = [axis.label(start)] + [axis.label(stop - 1)] * (stop - start > 1)
        parts.append(f"{axis.name}={'..'.join(labels)}")
    return ", ".join(parts) or "the only point"
