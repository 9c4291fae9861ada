"""Render every combination of values of some settings: `grid`."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._extras import import_extra
from vkbloom._free_memory import free_memory
from vkbloom._grid import cluster
from vkbloom._grid.filling import Filler, progress_bar
from vkbloom._grid.keys import Keys, open_keys
from vkbloom._grid.layout import Grid, Layout, Variable, ask, lay_out, make_dataset
from vkbloom._grid.order import GridBlock, Index, default_chunk, read_part
from vkbloom._grid.sources import ImageSource
from vkbloom._grid.store import IDENTITY, GridStore, chunk_in, prepare, stored_identity
from vkbloom._numbers import check_index
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.image import Image
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.antialiasing import Antialiasing
from vkbloom._settings.exposure import Exposure
from vkbloom._settings.settings import Settings, Shading

if TYPE_CHECKING:
    import xarray
    from distributed import Client

    from vkbloom._scene import Scene

#: Limits of a block: large enough for an efficient file, small enough to render again if lost.
BLOCK_BYTES = 1 << 20
BLOCK_POINTS = 1024
# A grid may take all free memory but this part of its own size.
_MARGIN = 10


@public("vkbloom")
@check_arguments
def grid(
    source: Scene | NDArray[Any] | Image,
    settings: Settings | str | None = None,
    axes: Mapping[str, Iterable[Any]] | None = None,
    *,
    size: tuple[int, int] | None = None,
    shading: Shading = "forward",
    time: float = 0.0,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
    exposure: Exposure | str | None = None,
    taa: Antialiasing | str | None = None,
    dt: float | None = None,
    motion: NDArray[Any] | None = None,
    depth: NDArray[Any] | None = None,
    state: Mapping[str, Any] | None = None,
    framebuffers: Literal["all"] | str | Sequence[str] = ("final",),
    reduce: Mapping[str, Callable[[Frames], Any]] | None = None,
    store: Any = None,
    chunks: Mapping[str, int] | None = None,
    part: tuple[int, int] | str | None = None,
    resume: bool = True,
    client: Client | None = None,
    adapter: str | None = None,
    progress: bool | None = None,
    renderer: Renderer | None = None,
) -> xarray.Dataset:
    """Render every combination of values of some settings, in memory or into a Zarr store.

    Parameters
    ----------
    source : Scene or image
        An uploaded image has its mask and emission; it belongs to one renderer, so it has no store
        that a cluster fills.
    settings : Settings or str, optional
        The settings that the axes change, or the name of a preset. Default:
        ``presets["bevy_natural"]`` for images, ``presets["tutorial"]`` for a scene.
    axes : mapping of str to sequence
        Values by settings field, or by "time" for a scene. The axis "preset" has names of
        `vkbloom.presets`, the axis "settings" a list of Settings of any methods, or of names of
        presets. Only one of these two axes and the argument `settings` can be given. All other
        axes change the settings of these axes, too.
    size : (int, int), optional
        Width and height of a scene's frames. Default: (1280, 720).
    shading, time
        Of a scene, as for `render`.
    mask, emission : ndarray, optional
        As for `apply`, the same at all points. An uploaded image has its own.
    exposure, taa, dt, motion, depth, state
        As for `Renderer.sweep`: points are no frames in time, and each is the one `dt` seconds
        after `state`. An axis "exposure" of names or exposures, an axis "taa" of names or
        anti-aliasing, and an axis "dt" vary them. Motion and depth are arrays of the host.
    framebuffers : "all" or sequence of str
        The framebuffers to keep. Each must have the same shape at all points. Its dtype must be
        uint8 at all points, or a float type at all points. Floats are stored in the largest of
        their dtypes.
    reduce : mapping of str to callable, optional
        Figures to keep, by name. Each callable gets the `Frames` of a point and returns a number
        or a small array. With ``framebuffers=()`` only they are kept. A callable gets the
        framebuffers that its attribute ``framebuffers`` names, or all if it has no such attribute.
    store : str, path-like or zarr.abc.store.Store, optional
        Where to write the grid instead: a folder ``name.zarr``, a URL that fsspec supports, such
        as ``"s3://bucket/name.zarr"`` (the extra ``cloud`` installs S3) or ``"memory://name"``, or
        a Zarr store. With a `client`, all its workers must be able to write to it. It can be opened
        with `xarray.open_zarr` while it is written; its variable ``done`` tells which points are
        complete. If the process is killed, the same call renders only the missing points.
    chunks : mapping of str to int, optional
        Grid points per chunk of the store by axis; 1 for an axis that is not named. Default: chunks
        of about 1 MiB, at most 1024 points, along the axes that vary fastest.
    part : (int, int) or str, optional
        Render only part i of n of a store, from 1. Part 0 is part n. Each part is a run of chunks,
        about 1/n of the points. Processes may render parts at the same time, in any order and
        repeatedly; what is done is not rendered again. Text is "3/16". The default of `chunks` has
        at least n chunks; name `chunks` for the same bytes as without parts.
    resume : bool
        Whether to continue an existing store: its points are read first, and damaged ones are
        rendered again. False: raise FileExistsError.
    client : distributed.Client, optional
        The workers of its cluster render a store and write it. Default: this process does.
    adapter : str, optional
        The adapter of the renderers that the workers open, or that this process opens for the grid.
    progress : bool, optional
        True: a progress bar in a terminal or a notebook, but not elsewhere. None: the same if tqdm
        is installed. False: no progress bar.
    renderer : Renderer, optional
        Default: `default_renderer`.

    Returns
    -------
    xarray.Dataset
        One dimension for each axis, in the given order, then "y", "x" and "channel"; one variable
        for each framebuffer and each reduction. The attributes have the remaining settings (as
        JSON), the adapter, the driver and the version. A store is opened lazily.

    Raises
    ------
    ValueError
        An argument is out of range; a framebuffer has different shapes along an axis, or is missing
        at a point; or the store contains another grid (the message lists the differences) or other
        data. This is checked before anything is rendered or written.
    MemoryError
        The result does not fit into the free memory. Nothing was rendered.
    FileExistsError
        The store exists and `resume` is False.
    OSError
        Reading or writing the store failed, for example because the disk is full or credentials are
        missing. Completed points are kept.

    Notes
    -----
    Points are rendered in the order that runs the fewest passes; the order of the axes does not
    matter. The bytes of a store depend on its grid, its chunks and the adapter, not on workers,
    parts or interruptions.

    Examples
    --------
    >>> image = np.zeros((32, 48, 3), np.float32)
    >>> image[16, 24] = 50
    >>> grid = vkbloom.grid(image, axes={"preset": ["kino", "filament"], "intensity": [0.5, 1.0]})
    >>> dict(grid.sizes)
    {'preset': 2, 'intensity': 2, 'y': 32, 'x': 48, 'channel': 3}
    >>> grid["final"].sel(preset="kino", intensity=0.5).shape
    (32, 48, 3)
    """
    xr = import_extra("xarray", "grid", "grid")
    given = {"chunks": chunks, "part": part, "client": client}
    for name, value in given.items():
        if store is None and value is not None:
            raise ValueError(f"{name}: a grid in memory has none; give store, too")
    if renderer is not None and (client is not None or adapter is not None):
        raise ValueError("renderer: the grid is rendered by those of client or adapter; give one")
    keys = None if store is None else open_keys(store)
    asked = ask(
        source,
        settings,
        axes,
        size=size,
        shading=shading,
        time=time,
        framebuffers=framebuffers,
        reduce=reduce,
        mask=mask,
        emission=emission,
        exposure=exposure,
        taa=taa,
        dt=dt,
        motion=motion,
        depth=depth,
        state=state,
    )
    with ExitStack() as stack:
        if client is None and adapter is not None:
            renderer = stack.enter_context(open_renderer(adapter))
        if keys is None:
            return in_memory(asked, renderer or default_renderer(), progress)
        numbers = read_part(part)
        keys.check_writable()
        if client is not None:
            keys.check_shared()
        _check_stored(asked, chunks, is_shared=client is not None)

        def prepare_store(layout: Layout) -> GridStore:
            chunk = _chunk(asked, layout, chunks, keys, numbers[1])
            return prepare(keys, asked, layout, chunk, numbers, resume=resume)

        if client is not None:
            cluster.fill_there(client, asked, prepare_store, adapter or "auto", progress)
        else:
            renderer = renderer or default_renderer()
            stored = prepare_store(lay_out(asked, renderer))
            with progress_bar(stored.total, stored.done, shown=progress) as count:
                filler = Filler(asked, stored.layout, renderer, count)
                filler.store(stored.missing, stored.chunks)
    dataset: xarray.Dataset = xr.open_zarr(keys.folder or keys.store, zarr_format=3)
    dataset.attrs.pop(IDENTITY, None)
    return dataset


def _check_stored(grid: Grid, chunks: Mapping[str, int] | None, *, is_shared: bool) -> None:
    """Raise TypeError or ValueError for a grid that cannot be stored, or not by workers."""
    if is_shared and isinstance(grid.source, ImageSource) and isinstance(grid.source.image, Image):
        raise TypeError("source: an uploaded image belongs to one renderer; give the array itself")
    names = [axis.name for axis in grid.axes]
    if "done" in names:
        raise ValueError("axes: 'done' is not a possible name; the store uses it for its marks")
    for name, count in (chunks or {}).items():
        if name not in names:
            raise ValueError(
                f"chunks: {name!r} is not an axis of the grid; it has {', '.join(names)}"
            )
        check_index(f"chunks: {name}", count, 1, sys.maxsize)


def _chunk(
    grid: Grid, layout: Layout, chunks: Mapping[str, int] | None, keys: Keys, parts: int
) -> Index:
    """Return the grid points per chunk by axis: requested, from the store, or the default."""
    if chunks is None:
        stored = stored_identity(keys)
        held = None if stored is None else chunk_in(stored, grid.shape)
        return chunk_of(grid, layout, parts) if held is None else held
    return tuple(min(int(chunks.get(axis.name, 1)), len(axis)) for axis in grid.axes)


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
    left = free_memory()
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
    with progress_bar(math.prod(shape), shown=progress) as count:
        Filler(grid, layout, renderer, count).fill(GridBlock((0,) * len(shape), shape), arrays)
    return make_dataset(grid, layout, arrays)
