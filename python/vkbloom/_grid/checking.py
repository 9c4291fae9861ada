"""Check a grid's store for missing and damaged data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vkbloom._argument_types import checked
from vkbloom._grid.axes import Axis
from vkbloom._grid.chunks import DONE, Chunks
from vkbloom._grid.keys import Keys, open_keys
from vkbloom._grid.order import Block, blocks
from vkbloom._grid.store import METADATA, checked_identity


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
        The store is not a grid, has another format version, or the group's metadata are damaged.
    """
    keys = open_keys(store)
    held = keys.all()
    if not held:
        raise FileNotFoundError(f"{keys.name}: the store does not exist or is empty")
    own = checked_identity(keys)
    try:
        return _report(own, keys, held)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{keys.name}: its {METADATA} is damaged: {error}") from error


def _report(own: Mapping[str, Any], keys: Keys, held: set[str]) -> GridReport:
    axes = [Axis(name, tuple(own["axes"][name]), "settings", "", "") for name in own["axes"]]
    variables = {name: len(variable["shape"]) for name, variable in own["variables"].items()}
    chunks = Chunks(keys, variables, tuple(own["chunk"]))
    shape = tuple(map(len, axes))
    there = (key.removesuffix(f"/{METADATA}") for key in held if "/" in key and METADATA in key)
    problems = [
        f"{problem}, of all points"
        for name in dict.fromkeys((DONE, *variables, *own["axes"], *there))
        if (problem := chunks.array_problem(name, held))
    ]
    done = 0
    for block in blocks(shape, chunks.chunk, range(len(shape))) if not problems else ():
        marked = chunks.marked(block, held)
        done += block.count * (marked is True)
        problems += _problems_of(chunks, block, marked, held, describe(axes, block))
    return GridReport(math.prod(shape), done, tuple(problems))


def describe(axes: Iterable[Axis], block: Block) -> str:
    """Return the points of a block as text: the value, or first and last value, of each axis."""
    parts = []
    for axis, start, stop in zip(axes, block.start, block.stop, strict=True):
        labels = [axis.label(start)] + [axis.label(stop - 1)] * (stop - start > 1)
        parts.append(f"{axis.name}={'..'.join(labels)}")
    return ", ".join(parts) or "the only point"


def _problems_of(
    chunks: Chunks, block: Block, marked: bool | str, held: set[str], points: str
) -> Iterator[str]:
    """Yield each missing or damaged chunk of a block that is marked as done."""
    if isinstance(marked, str):
        yield f"{chunks.key(DONE, block)} is {marked}, of {points}"
    for name in chunks.trailing if marked is True else ():
        if problem := chunks.problem(name, block, held):
            yield f"{chunks.key(name, block)} is {problem}, of {points}"
