"""Render grids to Zarr stores: `grid_to_zarr`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.frames import Frames
from vkbloom.grid.identity import chunk_in
from vkbloom.grid.keys import Keys, open_keys
from vkbloom.grid.layout import Grid, Layout, ask
from vkbloom.grid.memory import chunk_of
from vkbloom.grid.order import Index
from vkbloom.grid.parts import read_part
from vkbloom.grid.rendering import render_grid
from vkbloom.grid.sources import ImageSource
from vkbloom.grid.store import IDENTITY, METADATA, GridStore, read_json, stored_identity
from vkbloom.image import Image
from vkbloom.settings import Settings, Shading

if TYPE_CHECKING:
    import xarray
    from distributed import Client

    from vkbloom.scene import Scene

__all__ = ["check_chunks", "grid_to_zarr"]


def grid_to_zarr(
    source: Scene | NDArray[Any] | Sequence[NDArray[Any]] | Mapping[str, NDArray[Any]],
    settings: Settings | None,
    axes: Mapping[str, Iterable[Any]],
    store: Any,
    *,
    client: Client | None = None,
    chunks: Mapping[str, int] | None = None,
    part: tuple[int, int] | str | None = None,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
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
    """Render all combinations of the axes' values to a Zarr store.

    The store can be opened with ``xarray.open_zarr`` while it is written; its variable ``done``
    tells which points are complete. If the process is killed, the same call renders only the
    missing points.

    Parameters
    ----------
    source, settings, axes, mask, emission, size, shading, time, attachments, reduce, progress
        As for `vkbloom.Renderer.grid`.
    store : str, path-like or zarr.abc.store.Store
        A folder, a URL that fsspec supports, or a store. With a `client`, all its workers must be
        able to write to it.
    client : distributed.Client, optional
        The workers of its cluster render and write. Default: this process does.
    chunks : mapping of str to int, optional
        Grid points per chunk by axis; 1 for an axis that is not named. Default: chunks of about
        1 MiB, at most 1024 points, along the axes that vary fastest. A chunk is written when all
        its points are rendered; chunks along slower axes make more passes run.
    part : (int, int) or str, optional
        Render only part i of n, from 1. Part 0 is part n. Each part is a run of chunks, about 1/n
        of the points. Processes may render parts at the same time, in any order and repeatedly;
        `check_grid` names missing parts. Text is "3/16"; "auto/16" takes i, and "auto" also n,
        from the environment of a job array, such as SLURM_ARRAY_TASK_ID. The default of `chunks`
        has at least n chunks; name `chunks` for the same bytes as without parts.
    adapter, validation
        Arguments of the renderers, as for `vkbloom.Renderer`.
    resume : bool
        Whether to continue an existing store. False: raise FileExistsError.
    verify : bool
        Whether to read the existing points first and render damaged ones again. False: trust the
        marks in ``done``.
    on_mended : callable, optional
        Called with a line of text for each damaged or missing key that was replaced.

    Returns
    -------
    xarray.Dataset
        The store, opened lazily. The attributes "passes_run" and "passes_saved" count the passes
        of this call.

    Raises
    ------
    ValueError
        The store contains another grid (the message lists the differences) or other data, or an
        argument is wrong as for `vkbloom.Renderer.grid`. Nothing is written.
    FileExistsError
        The store exists and `resume` is False.
    OSError
        Writing failed, for example because the disk is full. Completed points are kept.
    ModuleNotFoundError
        zarr is missing, or dask if `client` is given.

    See Also
    --------
    Renderer.grid : The same in memory.
    check_grid : Checks a store.
    contact_sheet, response_curves : Pictures and plots of the result.

    Examples
    --------
    >>> import tempfile
    >>> image = np.zeros((16, 16, 4), np.uint8)
    >>> image[8, 8] = 255
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     grid = vkbloom.grid_to_zarr(
    ...         image,
    ...         vkbloom.Separable(),
    ...         {"blur_scale": [1.0, 2.0], "intensity": [0.5, 1.0, 2.0]},
    ...         f"{folder}/grid.zarr",
    ...         adapter="software",
    ...     )
    ...     print(dict(grid.sizes))
    {'blur_scale': 2, 'intensity': 3, 'y': 16, 'x': 16, 'channel': 4}
    """
    xr = import_extra("xarray", "grid", "grid_to_zarr")
    import_extra("dask.array", "grid", "grid_to_zarr")
    keys = open_keys(store)
    grid = ask(
        source,
        settings,
        axes,
        mask=mask,
        emission=emission,
        size=size,
        shading=shading,
        time=time,
        attachments=attachments,
        reduce=reduce,
    )
    if isinstance(grid.source, ImageSource) and any(
        isinstance(image, Image) for image in grid.source.images
    ):
        raise TypeError("source: an uploaded image belongs to one renderer; give the array itself")
    if "done" in (axis.name for axis in grid.axes):
        raise ValueError("axes: 'done' is not a possible name; the store uses it for its marks")
    check_chunks(grid, chunks)
    own = read_part(part)
    if client is not None and not keys.is_shared:
        raise ValueError("store: the workers cannot write to a store in memory; use a folder")

    def prepared(layout: Layout) -> GridStore:
        kept = GridStore(keys, grid, layout, _chunk(grid, layout, chunks, keys, own[1]), own)
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


def _chunk(
    grid: Grid, layout: Layout, chunks: Mapping[str, int] | None, keys: Keys, parts: int
) -> Index:
    """Return the grid points per chunk by axis: requested, from the store, or the default."""
    if chunks is None:
        stored = stored_identity(read_json(keys.read(METADATA)) or {})
        held = None if stored is None else chunk_in(stored, grid.shape)
        return chunk_of(grid, layout, parts) if held is None else held
    return tuple(min(int(chunks.get(axis.name, 1)), len(axis)) for axis in grid.axes)


def check_chunks(grid: Grid, chunks: Mapping[str, int] | None) -> None:
    """Check the argument `chunks` of `grid_to_zarr`: a mapping of axis names to counts from 1."""
    if chunks is None:
        return
    if not isinstance(chunks, Mapping):
        raise TypeError(f"chunks: {chunks!r} is not a mapping of axis names to point counts")
    names = [axis.name for axis in grid.axes]
    for name, count in chunks.items():
        if name not in names:
            raise ValueError(
                f"chunks: {name!r} is not an axis of the grid; it has {', '.join(names)}"
            )
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise ValueError(f"chunks: {name}: {count!r} is not an integer of at least 1")
