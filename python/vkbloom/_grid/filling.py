"""Render blocks of points, and reduce their frames, into arrays or a store."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._background_writer import write_in_background
from vkbloom._extras import import_extra
from vkbloom._grid.layout import Grid, Layout, check_value
from vkbloom._grid.order import GridBlock, Index, points
from vkbloom._grid.sources import visit
from vkbloom._grid.store import Chunks
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer

#: Is called with the number of points that are done.
Count = Callable[[int], object]


def _ignore(points: int) -> None:
    """Count nothing."""


@dataclass(frozen=True, eq=False)
class Filler:
    """Renders points of one grid on one renderer."""

    grid: Grid
    layout: Layout
    renderer: Renderer
    count: Count = _ignore

    def fill(self, block: GridBlock, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Render the points of a block."""
        grid = self.grid
        path = map(grid.point, points(block, self.layout.ranking))
        for index, frames in visit(self.renderer, grid.source, path, grid.wanted, grid.before):
            inside = tuple(i - start for i, start in zip(index, block.start, strict=True))
            for name, array in arrays.items():
                array[inside] = self._value(name, index, frames)
            self.count(1)

    def _value(self, name: str, index: Index, frames: Frames) -> NDArray[Any]:
        variable = self.layout.variables[name]
        reduction = self.grid.reduce.get(name)
        value = frames[name] if reduction is None else check_value(name, reduction(frames))
        if value.shape != variable.shape or not np.can_cast(
            value.dtype, variable.dtype, "same_kind"
        ):
            raise ValueError(
                f"{name}: {value.shape} {value.dtype} at {self.grid.describe_point(index)} is not "
                f"{variable.shape} {variable.dtype} as at the grid's first point"
            )
        return value

    def store(self, todo: Iterable[GridBlock], chunks: Chunks) -> None:
        """Render blocks, and write each while the next one is rendered."""

        def make() -> Iterator[tuple[None, Callable[[], None]]]:
            for block in todo:
                arrays = {
                    name: np.empty((*block.shape, *variable.shape), variable.dtype)
                    for name, variable in self.layout.variables.items()
                }
                self.fill(block, arrays)
                yield None, functools.partial(chunks.write, block, arrays)

        for _ in write_in_background(make()):
            pass


def _is_watched() -> bool:
    """Return whether standard error is a terminal, or this process a notebook's kernel."""
    if sys.stderr is not None and sys.stderr.isatty():
        return True
    # It may just be imported by another thread.
    get_ipython = getattr(sys.modules.get("IPython"), "get_ipython", None)
    shell = get_ipython() if get_ipython else None
    return shell is not None and "IPKernelApp" in shell.config


@contextmanager
def progress_bar(total: int, done: int = 0, *, shown: bool | None = None) -> Iterator[Count]:
    """Yield a function that counts points, and show them in a terminal or a notebook.

    - `total`: Number of points of the grid.
    - `done`: Number of points that were done before.
    - `shown`: None: if tqdm is installed.
    """
    if shown is False or (shown is None and find_spec("tqdm") is None):
        yield _ignore
        return
    tqdm = import_extra("tqdm.auto", "grid", "A progress bar").tqdm
    hidden = not _is_watched()
    with tqdm(total=total, initial=done, unit="point", mininterval=0.2, disable=hidden) as bar:
        yield bar.update
