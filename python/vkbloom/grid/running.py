"""Render blocks of points in this process and write them to a sink."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from vkbloom.grid.filling import Filler, Tally
from vkbloom.grid.layout import Grid, Layout
from vkbloom.grid.order import Block
from vkbloom.grid.progress import Progress
from vkbloom.written_behind import written_behind

if TYPE_CHECKING:
    from vkbloom.renderer import Renderer

__all__ = ["Sink", "Writer", "empty_arrays", "run_here", "written"]

# Blocks are flushed and marked as done after this time, or this number of blocks.
_COMMIT_SECONDS: Final = 2.0
_COMMIT_BLOCKS: Final = 64


class Writer(Protocol):
    """Writes blocks; it can be sent to the process that renders them."""

    def write(self, block: Block, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a block's variables."""

    def flush(self, written: Iterable[Block]) -> None:
        """Flush blocks to the disk."""


class Sink(Protocol):
    """The storage of a grid: a Zarr store or a folder of image files."""

    @property
    def done(self) -> NDArray[np.bool_]:
        """Whether each point is done, in the grid's shape."""

    @property
    def total(self) -> int:
        """Number of points to render, including those that are done."""

    @property
    def writer(self) -> Writer:
        """The writer, which can be sent to other processes."""

    def missing(self) -> Iterable[Block]:
        """Return the blocks that are not done, in the order of visiting."""

    def mark(self, written: Iterable[Block]) -> None:
        """Mark points as done; their data must be on the disk."""

    def finish(self) -> None:
        """Do what is left to do when all points are done."""


def empty_arrays(layout: Layout, block: Block) -> dict[str, NDArray[Any]]:
    """Return arrays for the points of a block."""
    return {
        name: np.empty((*block.shape, *variable.shape), variable.dtype)
        for name, variable in layout.variables.items()
    }


def run_here(
    grid: Grid,
    layout: Layout,
    sink: Sink,
    todo: Iterable[Block],
    *,
    renderer: Renderer,
    progress: Progress,
) -> None:
    """Render blocks one after the other.

    Blocks that were written are marked as done, also when an exception ends the call.
    """
    filler = Filler(grid, layout, renderer)
    pending: list[Block] = []
    committed = time.monotonic()

    def commit() -> None:
        if pending:
            sink.writer.flush(pending)
            sink.mark(pending)
            pending.clear()

    try:
        for block in written(filler, sink.writer, todo, layout, progress.add):
            pending.append(block)
            if len(pending) >= _COMMIT_BLOCKS or time.monotonic() - committed > _COMMIT_SECONDS:
                commit()
                committed = time.monotonic()
        commit()
    except BaseException as error:
        _commit_after(error, commit)
        raise


def written(
    filler: Filler,
    writer: Writer,
    todo: Iterable[Block],
    layout: Layout,
    on_point: Callable[[Tally], object],
) -> Iterator[Block]:
    """Render blocks, and write each while the next one is rendered."""

    def made() -> Iterator[tuple[Block, Callable[[], None]]]:
        for block in todo:
            arrays = empty_arrays(layout, block)
            filler.fill(block, arrays, on_point)
            yield block, functools.partial(writer.write, block, arrays)

    return written_behind(made())


def _commit_after(error: BaseException, commit: Callable[[], None]) -> None:
    try:
        commit()
    except OSError as second:
        # On a full disk the marks may not fit either. A resumed grid finds complete blocks.
        error.add_note(f"the last written points could not be marked as done: {second}")
