"""Render a grid in memory, as one Dataset."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vkbloom._free_memory import memory_left
from vkbloom._grid.filling import Filler, Tally
from vkbloom._grid.layout import Grid, Layout, Variable, lay_out, made_dataset
from vkbloom._grid.order import blocks, default_chunk
from vkbloom._grid.progress import Progress
from vkbloom._renderer.renderer import Renderer

if TYPE_CHECKING:
    import xarray


#: Limits of a block: large enough for an efficient file, small enough to render again if lost.
BLOCK_BYTES = 1 << 20
BLOCK_POINTS = 1024
# A grid may take all free memory but this part of its own size.
_MARGIN = 10


def chunk_of(grid: Grid, layout: Layout, parts: int = 1) -> tuple[int, ...]:
    """Return the number of points per block along each axis, with a block for each part."""
    most = min(
        BLOCK_POINTS, math.prod(grid.shape) // parts, BLOCK_BYTES // max(layout.point_size, 1)
    )
    return default_chunk(grid.shape, layout.ranking, max(most, 1))


def check_fits(grid: Grid, variables: Mapping[str, Variable]) -> None:
    """Raise MemoryError for a grid that does not fit into the free memory."""
    points = math.prod(grid.shape)
    size = points * sum(variable.size for variable in variables.values())
    left = memory_left()
    # NumPy, the device and the results that are reduced need memory, too.
    if left is not None and size + size // _MARGIN > left:
        raise MemoryError(
            f"a grid of {points} points with {', '.join(variables)} needs {_gigabytes(size)} of "
            f"memory and a tenth as reserve, but {_gigabytes(left)} are free; write a store with "
            "grid, or keep only the figures of reduce with framebuffers=()"
        )


def _gigabytes(size: int) -> str:
    return f"{size / 1e9:,.1f} GB"


def in_memory(grid: Grid, renderer: Renderer, progress: bool | None) -> xarray.Dataset:
    """Render a grid into a Dataset."""
    layout = lay_out(grid, renderer, lambda variables: check_fits(grid, variables))
    shape = grid.shape
    arrays = {
        name: np.empty((*shape, *variable.shape), variable.dtype)
        for name, variable in layout.variables.items()
    }
    filler = Filler(grid, layout, renderer)
    with Progress(math.prod(shape), shown=progress) as shown:
        shown.add(Tally(ran=layout.ran))
        for block in blocks(shape, chunk_of(grid, layout), layout.ranking):
            views = {name: array[block.slices] for name, array in arrays.items()}
            filler.fill(block, views, shown.add)
    made = made_dataset(grid, layout, arrays)
    return made.assign_attrs(passes_run=shown.tally.ran)
