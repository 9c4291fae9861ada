"""Render blocks of points, and reduce their frames, into arrays or a store."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._background_writer import written_in_background
from vkbloom._grid.chunks import Chunks
from vkbloom._grid.layout import Grid, Layout, checked_value
from vkbloom._grid.order import Block, Index, points
from vkbloom._grid.sources import visit
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer


@dataclass
class Tally:
    """Number of points, and of the passes that ran."""

    points: int = 0
    ran: int = 0

    def add(self, other: Tally) -> None:
        """Add another tally."""
        self.points += other.points
        self.ran += other.ran


class Filler:
    """Renders points of one grid on one renderer."""

    def __init__(self, grid: Grid, layout: Layout, renderer: Renderer) -> None:
        self._grid = grid
        self._layout = layout
        self._renderer = renderer

    def fill(
        self,
        block: Block,
        arrays: Mapping[str, NDArray[Any]],
        on_point: Callable[[Tally], object] = lambda tally: None,
    ) -> Tally:
        """Render the points of a block."""
        grid, total = self._grid, Tally()
        path = map(grid.point, points(block, self._layout.ranking))
        for index, frames in visit(self._renderer, grid.source, path, grid.wanted):
            inside = tuple(i - start for i, start in zip(index, block.start, strict=True))
            for name, array in arrays.items():
                self._put(name, index, frames, array, inside)
            count = Tally(1, len(frames.timings))
            total.add(count)
            on_point(count)
        return total

    def _put(
        self, name: str, index: Index, frames: Frames, array: NDArray[Any], inside: Index
    ) -> None:
        variable = self._layout.variables[name]
        reduction = self._grid.reduce.get(name)
        value = frames[name] if reduction is None else checked_value(name, reduction(frames))
        if value.shape != variable.shape or not np.can_cast(
            value.dtype, variable.dtype, "same_kind"
        ):
            raise ValueError(
                f"{name}: {value.shape} {value.dtype} at {self._grid.named(index)} is not "
                f"{variable.shape} {variable.dtype} as at the grid's first point"
            )
        array[inside] = value

    def store(
        self,
        todo: Iterable[Block],
        chunks: Chunks,
        on_point: Callable[[Tally], object] = lambda tally: None,
    ) -> Tally:
        """Render blocks, and write each while the next one is rendered."""
        total = Tally()

        def made() -> Iterator[tuple[Tally, Callable[[], None]]]:
            for block in todo:
                arrays = {
                    name: np.empty((*block.shape, *variable.shape), variable.dtype)
                    for name, variable in self._layout.variables.items()
                }
                yield (
                    self.fill(block, arrays, on_point),
                    functools.partial(chunks.write, block, arrays),
                )

        for tally in written_in_background(made()):
            total.add(tally)
        return total
