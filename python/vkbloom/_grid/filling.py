"""Render blocks of points, and reduce their frames, into arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._grid.layout import Grid, Layout, PassCounter, checked_value
from vkbloom._grid.order import Block, Index, points
from vkbloom._grid.reductions import Comparing
from vkbloom._grid.sources import visit
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer

__all__ = ["Filler", "Tally"]


@dataclass
class Tally:
    """Number of points, and of their passes.

    - `ran`: Passes that ran, including those of reference frames.
    - `alone`: Passes that the same points need if each is rendered alone, without fused passes.
    """

    points: int = 0
    ran: int = 0
    alone: int = 0

    @property
    def saved(self) -> int:
        """Passes that did not have to run; 0 if reference frames need more than that."""
        return max(0, self.alone - self.ran)

    def add(self, other: Tally) -> None:
        """Add another tally."""
        self.points += other.points
        self.ran += other.ran
        self.alone += other.alone


class Filler:
    """Renders points of one grid on one renderer."""

    def __init__(self, grid: Grid, layout: Layout, renderer: Renderer) -> None:
        self._grid = grid
        self._layout = layout
        self._renderer = renderer
        self._counter = PassCounter(grid, layout, renderer)
        self._references = grid.references()
        self._held: dict[tuple[str, Index], NDArray[Any]] = {}

    def fill(
        self,
        block: Block,
        arrays: Mapping[str, NDArray[Any]],
        on_point: Callable[[Tally], object] = lambda tally: None,
    ) -> Tally:
        """Render the points of a block.

        `arrays`: By variable; the block's shape, then the variable's. They are filled.
        """
        grid, total = self._grid, Tally()
        order = list(points(block, self._layout.ranking))
        if self._references:
            total.add(Tally(ran=self._hold_references(order)))
            on_point(total)
        # Counted before rendering starts, because the renderer may run ahead of the results.
        alone = [self._counter.alone(index) for index in order]
        path = (grid.point(index) for index in order)
        found = visit(self._renderer, grid.source, path, grid.wanted)
        for (index, frames), passes in zip(found, alone, strict=True):
            place = tuple(i - start for i, start in zip(index, block.start, strict=True))
            for name, array in arrays.items():
                self._put(name, index, frames, array, place)
            count = Tally(1, len(frames.timings), passes)
            total.add(count)
            on_point(count)
        return total

    def _put(
        self, name: str, index: Index, frames: Frames, array: NDArray[Any], place: Index
    ) -> None:
        variable = self._layout.variables[name]
        reduction = self._grid.reduce.get(name)
        if reduction is None:
            value = frames[name]
        else:
            if name in self._references and isinstance(reduction, Comparing):
                reference = self._held[reduction.framebuffer, self._reference(name, index)]
                reduction = dataclasses.replace(reduction, against=reference)
            value = checked_value(name, reduction(frames))
        if value.shape != variable.shape or not np.can_cast(
            value.dtype, variable.dtype, "same_kind"
        ):
            raise ValueError(
                f"{name}: {value.shape} {value.dtype} at {self._grid.named(index)} is not "
                f"{variable.shape} {variable.dtype} as at the grid's first point"
            )
        array[place] = value

    def _reference(self, name: str, index: Index) -> Index:
        """Return the point whose frame is a reduction's reference for the point at an index."""
        fixed = self._references[name]
        return tuple(fixed.get(number, place) for number, place in enumerate(index))

    def _hold_references(self, order: list[Index]) -> int:
        """Render the reference frames of the points, and return the number of passes that ran."""
        needed: dict[tuple[str, Index], None] = {}
        for name in self._references:
            framebuffer = self._grid.reduce[name].framebuffer  # type: ignore[attr-defined]
            needed.update({(framebuffer, self._reference(name, index)): None for index in order})
        self._held = {key: array for key, array in self._held.items() if key in needed}
        missing = [key for key in needed if key not in self._held]
        names = sorted({framebuffer for framebuffer, _ in missing})
        path = (self._grid.point(index) for index in dict.fromkeys(index for _, index in missing))
        ran = 0
        for index, frames in visit(self._renderer, self._grid.source, path, names):
            self._held.update({(name, index): frames[name] for name in names})
            ran += len(frames.timings)
        return ran
