"""Grids into Zarr stores: `grid_to_zarr`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.frames import Frames
from vkbloom.grid.identity import chunk_in
from vkbloom.grid.keys import Keys, open_keys
from vkbloom.grid.memory import chunk_of
from vkbloom.grid.order import Index
from vkbloom.grid.plan import Grid, Layout, ask
from vkbloom.grid.rendering import render_grid
from vkbloom.grid.store import IDENTITY, ROOT, GridStore, read_json, stored_identity
from vkbloom.settings import Settings, Shading

if TYPE_CHECKING:
    import xarray
    from distributed import Client

    from vkbloom.scene import Scene

__all__ = ["grid_to_zarr"]


def grid_to_zarr(
    source: Scene | NDArray[Any] | Sequence[NDArray[Any]] | Mapping[str, NDArray[Any]],
    settings: Settings | None,
    axes: Mapping[str, Iterable[Any]],
    store: Any,
    *,
    client: Client | None = None,
    chunks: Mapping[str, int] | None = None,
    size: tuple[int, int] | None = None,
    shading: Shading = "forward",
    time: float = 0.0,
    attachments: Literal["all"] | str | Sequence[str] = ("final",),
    reduce: Mapping[str, Callable[[Frames], Any]] | None = None,
    adapter: str = "auto",
    validation: bool = False,
    resume: bool = True,
    verify: bool = True,
    on_mended: Callable[[str], object] | None = None,
    progress: bool | None = None,
) -> xarray.Dataset:
    """Render every combination of some values into a Zarr store.

    The store can be opened with ``xarray.open_zarr`` from the beginning; its variable ``done``
    tells which points are there. When the process ends before its time, however it ends, the same
    call again renders the missing points only.

    Parameters
    ----------
    source, settings, axes, size, shading, time, attachments, reduce, progress
        As for `vkbloom.Renderer.grid`.
    store : str, path-like or zarr.abc.store.Store
        A folder, a URL that fsspec knows, or a store. With a `client` all workers must be able
        to write to it.
    client : distributed.Client, optional
        The workers of its cluster render and write; by default this process does.
    chunks : mapping of str to int, optional
        Points in a chunk by axis, 1 for axes left out. By default as many as make up about
        1 MiB, 1024 at most, along the axes that are visited fastest. A chunk is written when all
        its points are there; chunks along other axes than the fastest cost passes.
    adapter, validation
        Of the renderers, as for `vkbloom.Renderer`.
    resume : bool
        Go on with a store that is there. False: raise FileExistsError.
    verify : bool
        Read what is there before going on, and render damaged points again. False: trust the
        marks in ``done``.
    on_mended : callable, optional
        Called with a line of text for each thing that was damaged.

    Returns
    -------
    xarray.Dataset
        The store, opened lazily, with "passes_run" and "passes_saved" of this call added to its
        attributes.

    Raises
    ------
    ValueError
        The store holds another grid (the message tells what differs) or something else; or as
        for `vkbloom.Renderer.grid`. Nothing was written.
    FileExistsError
        The store exists and `resume` is False.
    OSError
        Writing failed, for example because the disk is full. What is done is kept.
    ModuleNotFoundError
        zarr, or for a client dask, is missing.
    """
    xr = import_extra("xarray", "grid", "grid_to_zarr")
    import_extra("dask.array", "grid", "grid_to_zarr")
    keys = open_keys(store)
    grid = ask(
        source,
        settings,
        axes,
        size=size,
        shading=shading,
        time=time,
        attachments=attachments,
        reduce=reduce,
    )
    if "done" in (axis.name for axis in grid.axes):
        raise ValueError("axes: 'done' is the name of the marks of the points")
    if client is not None and not keys.is_shared:
        raise ValueError("store: other processes cannot write to a store in memory")

    def prepared(layout: Layout) -> GridStore:
        kept = GridStore(keys, grid, layout, _chunk(grid, layout, chunks, keys))
        for text in kept.prepare(resume=resume, verify=verify):
            if on_mended is not None:
                on_mended(text)
        return kept

    tally = render_grid(
        grid, prepared, client=client, adapter=adapter, validation=validation, progress=progress
    )
    dataset: xarray.Dataset = xr.open_zarr(keys.store)
    dataset.attrs.pop(IDENTITY, None)
    return dataset.assign_attrs(passes_run=tally.ran, passes_saved=tally.saved)


def _chunk(grid: Grid, layout: Layout, chunks: Mapping[str, int] | None, keys: Keys) -> Index:
    """Return the points of a block by axis: as asked for, as in the store, or by default."""
    if chunks is None:
        stored = stored_identity(read_json(keys.read(ROOT)) or {})
        held = None if stored is None else chunk_in(stored, grid.shape)
        return chunk_of(grid, layout) if held is None else held
    if not isinstance(chunks, Mapping):
        raise TypeError(f"chunks: numbers of points by axis are needed, not {chunks!r}")
    names = [axis.name for axis in grid.axes]
    for name, count in chunks.items():
        if name not in names:
            raise ValueError(f"chunks: {name!r} is not an axis of the grid: {', '.join(names)}")
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise ValueError(f"chunks: {name} is {count!r}, a whole number of at least 1 is needed")
    return tuple(min(int(chunks.get(axis.name, 1)), len(axis)) for axis in grid.axes)
