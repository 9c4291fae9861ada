"""The order in which the points of a grid are rendered, and their division into blocks and parts.

Loops over the axes are nested. The axis whose steps run the most passes is the outermost, so that
most steps run few passes.
"""

from __future__ import annotations

import itertools
import math
import operator
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

Index = tuple[int, ...]
#: The number of a part, from 1, and the number of parts.
Part: TypeAlias = tuple[int, int]

WHOLE: Final[Part] = (1, 1)


@dataclass(frozen=True)
class GridBlock:
    """Neighbouring points of a grid: a box along its axes, from `start` to `stop` by axis."""

    start: Index
    stop: Index

    @property
    def shape(self) -> Index:
        """Number of values by axis."""
        return tuple(stop - start for start, stop in zip(self.start, self.stop, strict=True))

    @property
    def count(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    @property
    def slices(self) -> tuple[slice, ...]:
        """Slices that select the box from an array with one dimension per axis."""
        return tuple(slice(*ends) for ends in zip(self.start, self.stop, strict=True))


def blocks(
    shape: Index, chunk: Index, ranking: Sequence[int], part: Part = WHOLE
) -> Iterator[GridBlock]:
    """Return the blocks of a part of a grid in the order in which they are visited.

    A part is a run of neighbouring blocks, so that its points share passes.
    """
    count = math.prod(-(-size // step) for size, step in zip(shape, chunk, strict=True))
    ends = (count * number // part[1] for number in (part[0] - 1, part[0]))
    every = itertools.product(*(range(0, shape[axis], chunk[axis]) for axis in ranking))
    for starts in itertools.islice(every, *ends):
        start = _in_order(starts, ranking)
        sides = zip(start, chunk, shape, strict=True)
        yield GridBlock(start, tuple(min(first + size, end) for first, size, end in sides))


def points(block: GridBlock, ranking: Sequence[int]) -> Iterator[Index]:
    """Yield the points of a block in the order in which they are visited."""
    ranges = (range(block.start[axis], block.stop[axis]) for axis in ranking)
    for numbers in itertools.product(*ranges):
        yield _in_order(numbers, ranking)


def _in_order(numbers: Sequence[int], ranking: Sequence[int]) -> Index:
    """Return numbers of ranked axes in the order of the axes."""
    return tuple(number for _, number in sorted(zip(ranking, numbers, strict=True)))


def default_chunk(shape: Index, ranking: Sequence[int], most: int) -> Index:
    """Return a chunk that spans complete fast axes, within a number of points."""
    chunk = [1] * len(shape)
    for axis in reversed(ranking):
        chunk[axis] = max(1, min(shape[axis], most))
        most //= chunk[axis]
        if chunk[axis] < shape[axis]:
            break
    return tuple(chunk)


def walk(shape: Index, *, backwards: bool) -> Iterator[tuple[int | None, Index]]:
    """Yield a corner of a grid, then a step along each axis in turn."""
    index = [count - 1 if backwards else 0 for count in shape]
    yield None, tuple(index)
    for axis, count in enumerate(shape):
        if count > 1:
            index[axis] += -1 if backwards else 1
            yield axis, tuple(index)


def ranking_of(costs: Sequence[int], later: Sequence[bool]) -> tuple[int, ...]:
    """Return the axes from the highest cost of a step to the lowest."""
    return tuple(sorted(range(len(costs)), key=lambda axis: (-costs[axis], later[axis])))


def read_part(part: Any) -> Part:
    """Check a part: (i, n), or text such as "3/16"; None is the whole.

    i is 1 to n. 0 is the same as n, so that arrays that count from 0 have all parts, too.
    """
    if part is None:
        return WHOLE
    if isinstance(part, str):
        if (numbers := re.fullmatch(r"([0-9]+)/([0-9]+)", part)) is None:
            raise ValueError(f"part: {part!r} is not I/N, such as 3/16")
        part = tuple(map(int, numbers.groups()))
    if not isinstance(part, tuple | list) or len(part) != 2:
        raise TypeError(f"part: {part!r} is not a pair (i, n), such as (3, 16)")
    if any(isinstance(number, bool) or not hasattr(number, "__index__") for number in part):
        raise TypeError(f"part: {part!r} is not a pair of integers")
    number, count = map(operator.index, part)
    if not 0 <= number <= count or count < 1:
        raise ValueError(f"part: {number} of {count} is not 1 to {max(count, 1)}")
    return number or count, count
