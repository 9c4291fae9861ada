"""Render blocks of points in this process and write them to a store."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from vkbloom._background_writer import written_in_background
from vkbloom._grid.chunks import Chunks
from vkbloom._grid.filling import Filler, Tally
from vkbloom._grid.layout import Grid, Layout
from vkbloom._grid.order import Block
from vkbloom._grid.progress import Progress
from vkbloom._grid.store import GridStore

if TYPE_CHECKING:
    from vkbloom._renderer.renderer import Renderer

# Blocks are flushed and marked as done after this time, or this number of blocks.
_COMMIT_SECONDS: Final = 2.0
_COMMIT_BLOCKS: Final = 64


def run_here(
    grid: Grid,
    layout: Layout,
    store: GridStore,
    renderer: Renderer,
    progress: Progress,
) -> None:
    """Render missing blocks one after the other.

    Blocks that were written are marked as done, also when an exception ends the call.
    """
    filler = Filler(grid, layout, renderer)
    pending: list[Block] = []
    committed = time.monotonic()

    def commit() -> None:
        if pending:
            store.writer.flush(pending)
            store.mark(pending)
            pending.clear()

    try:
        for block in written(filler, store.writer, store.missing(), layout, progress.add):
            pending.append(block)
            if len(pending) >= _COMMIT_BLOCKS or time.monotonic() - committed > _COMMIT_SECONDS:
                commit()
                committed = time.monotonic()
        commit()
    except BaseException as error:
        try:
            commit()
        except OSError as second:
            # On a full disk the marks may not fit either. A resumed grid finds complete blocks.
            error.add_note(f"the last written points could not be marked as done: {second}")
        raise


def written(
    filler: Filler,
    writer: Chunks,
    todo: Iterable[Block],
    layout: Layout,
    on_point: Callable[[Tally], object],
) -> Iterator[Block]:
    """Render blocks, and write each while the next one is rendered."""

    def made() -> Iterator[tuple[Block, Callable[[], None]]]:
        for block in todo:
            arrays = {
                name: np.empty((*block.shape, *variable.shape), variable.dtype)
                for name, variable in layout.variables.items()
            }
            filler.fill(block, arrays, on_point)
            yield block, functools.partial(writer.write, block, arrays)

    return written_in_background(made())
