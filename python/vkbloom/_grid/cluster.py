"""Render blocks of points on the workers of a Dask cluster.

Workers write the frames that they render and return only numbers of points. A task is a run of
neighbouring blocks, so that its points share passes.
"""

from __future__ import annotations

import math
import pickle
import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, TypeAlias

from vkbloom._core import Error
from vkbloom._extras import import_extra
from vkbloom._grid.filling import Filler, progress_bar
from vkbloom._grid.layout import Grid, Layout, lay_out, origin
from vkbloom._grid.order import GridBlock
from vkbloom._grid.store import Chunks, GridStore
from vkbloom._renderer.default import renderer_on
from vkbloom._renderer.renderer import Renderer

# Dask's own types are incomplete.
Client: TypeAlias = Any
Future: TypeAlias = Any

_PURPOSE: Final = "A grid on a Dask cluster"
# A run is short enough to balance the workers and to render again, long enough to amortize a task.
_RUN_POINTS: Final = 4096
_RUN_BYTES: Final = 64 << 20
_RUNS_A_WORKER: Final = 16
_RETRIES: Final = 2


def _unpickle(pickled: bytes) -> Grid:
    grid: Grid = pickle.loads(pickled)
    return grid


def _lay_out(grid: Grid, adapter: str) -> Layout:
    return lay_out(grid, renderer_on(adapter))


def _refusal(renderer: Renderer, layout: Layout) -> str:
    """Return why this worker's results may differ from the other workers'; "" if they cannot."""
    for what, here in origin(renderer).items():
        if here != layout.origin[what]:
            return (
                f"{what}: the worker's {here} is not the grid's {layout.origin[what]}; their "
                "pictures may differ, so all workers need the same adapter, driver and version"
            )
    return ""


def _render(
    blocks: tuple[GridBlock, ...], grid: Grid, layout: Layout, chunks: Chunks, adapter: str
) -> int | str:
    """Render and write a run of blocks; called in a worker. Text: why this worker may not."""
    renderer = renderer_on(adapter)
    # Returned and not raised, since Dask would repeat the task, perhaps on another worker.
    if refusal := _refusal(renderer, layout):
        return refusal
    Filler(grid, layout, renderer).store(blocks, chunks)
    return sum(block.count for block in blocks)


def _share_grid(client: Client, grid: Grid) -> Future:
    """Send a grid to a cluster, as the result of a task.

    Unlike scattered data, the result is computed again if the worker that holds it dies.
    """
    cloudpickle = import_extra("cloudpickle", "grid", _PURPOSE)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
        return client.submit(_unpickle, cloudpickle.dumps(grid), pure=False, retries=_RETRIES)


def lay_out_there(client: Client, shared: Future, adapter: str) -> Layout:
    """Lay out a grid on a worker's renderer: the client's machine may have no adapter."""
    laid: Layout = client.submit(_lay_out, shared, adapter, pure=False, retries=_RETRIES).result()
    return laid


def _runs(
    todo: Iterable[GridBlock], layout: Layout, points: int
) -> Iterator[tuple[GridBlock, ...]]:
    """Yield runs of neighbouring blocks, each of about `points` points."""
    most = max(1, min(points, _RUN_POINTS, _RUN_BYTES // max(layout.point_size, 1)))
    run: list[GridBlock] = []
    count = 0
    for block in todo:
        run.append(block)
        count += block.count
        if count >= most:
            yield tuple(run)
            run, count = [], 0
    if run:
        yield tuple(run)


def fill_there(
    client: Client,
    grid: Grid,
    prepared: Callable[[Layout], GridStore],
    adapter: str,
    progress: bool | None,
) -> None:
    """Let the workers of a cluster render the points of a store that are not done."""
    distributed = import_extra("distributed", "grid", _PURPOSE)
    if not isinstance(client, distributed.Client):
        raise TypeError(f"client: {client!r} is not a dask.distributed.Client")
    if client.asynchronous:
        raise TypeError("client: it is asynchronous; pass one made with asynchronous=False")
    shared = _share_grid(client, grid)
    store = prepared(lay_out_there(client, shared, adapter))
    missing = store.total - store.done
    points = math.ceil(missing / (max(1, len(client.nthreads())) * _RUNS_A_WORKER))
    runs = list(_runs(store.missing, store.layout, points))
    given = {"grid": shared, "layout": store.layout, "chunks": store.chunks, "adapter": adapter}
    futures = client.map(_render, runs, **given, pure=False, retries=_RETRIES)
    try:
        with progress_bar(store.total, store.done, shown=progress) as count:
            for _, result in distributed.as_completed(futures, with_results=True):
                if isinstance(result, str):
                    raise ValueError(result)
                count(result)
    except distributed.KilledWorker as error:
        raise Error(f"client: too many workers died: {error}") from error
    finally:
        client.cancel(futures, force=True)
