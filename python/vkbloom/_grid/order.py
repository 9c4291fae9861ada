"""The order in which the points of a grid are rendered, and their division into blocks.

Each step changes one axis only, as in reflected Gray code: after the last value of a fast axis, a
slower axis moves to its next value and the fast axis runs backwards. A step then runs only the
passes that depend on the axis that changed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from vkbloom._grid.parts import WHOLE, Part

Index = tuple[int, ...]


@dataclass(frozen=True)
class Block:
    """Neighbouring points of a grid: a box along its axes.

    - `start`, `stop`: The box, by axis.
    - `backwards`: By axis, whether the visit begins with the box's last value.
    """

    start: Index
    stop: Index
    backwards: tuple[bool, ...]

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


def _reflected(position: int, radices: Sequence[int]) -> Iterator[int]:
    """Yield the digits of a position in reflected Gray code, the slowest first."""
    for place in range(len(radices)):
        sweeps, digit = divmod(position // math.prod(radices[place + 1 :]), radices[place])
        yield radices[place] - 1 - digit if sweeps % 2 else digit


def blocks(
    shape: Index, chunk: Index, ranking: Sequence[int], part: Part = WHOLE
) -> Iterator[Block]:
    """Return the blocks of a part of a grid in the order in which they are visited.

    A part is a run of neighbouring blocks, so that its points share passes.
    """
    count = math.prod(-(-size // step) for size, step in zip(shape, chunk, strict=True))
    ends = (count * number // part[1] for number in (part[0] - 1, part[0]))
    return itertools.islice(_all_blocks(shape, chunk, ranking), *ends)


def _all_blocks(shape: Index, chunk: Index, ranking: Sequence[int]) -> Iterator[Block]:
    counts = [-(-shape[axis] // chunk[axis]) for axis in ranking]
    backwards = [False] * len(shape)
    for position in range(math.prod(counts)):
        start, stop = [0] * len(shape), [1] * len(shape)
        for axis, number in zip(ranking, _reflected(position, counts), strict=True):
            start[axis] = number * chunk[axis]
            stop[axis] = min(start[axis] + chunk[axis], shape[axis])
        block = Block(tuple(start), tuple(stop), tuple(backwards))
        yield block
        # Each axis has been swept once for every point of the slower ones within the block.
        sweeps = 1
        for axis in ranking:
            backwards[axis] ^= bool(sweeps % 2)
            sweeps *= block.shape[axis]


def points(block: Block, ranking: Sequence[int]) -> Iterator[Index]:
    """Yield the points of a block in the order in which they are visited."""
    index = list(block.start)

    def sweep(depth: int, backwards: list[bool]) -> Iterator[Index]:
        if depth == len(ranking):
            yield tuple(index)
            return
        axis = ranking[depth]
        numbers = range(block.start[axis], block.stop[axis])
        for number in reversed(numbers) if backwards[axis] else numbers:
            index[axis] = number
            yield from sweep(depth + 1, backwards)
        backwards[axis] ^= True

    return sweep(0, list(block.backwards))


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
