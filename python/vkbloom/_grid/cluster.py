"""Render blocks of points on the workers of a Dask cluster.

Workers write the frames that they render and return only tallies. A task is a run of neighbouring
blocks, so that its points share passes. The scheduler gets only as many tasks at a time as keep
all workers busy.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import math
import pickle
import threading
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from vkbloom._checks import import_extra
from vkbloom._core import DeviceLostError, Error
from vkbloom._grid.chunks import Chunks
from vkbloom._grid.filling import Filler, Tally
from vkbloom._grid.layout import Grid, Layout, lay_out, origin
from vkbloom._grid.order import Block
from vkbloom._grid.progress import Progress
from vkbloom._grid.running import written
from vkbloom._grid.store import GridStore
from vkbloom._renderer.renderer import Renderer

# Dask's own types are incomplete.
Client: TypeAlias = Any
Future: TypeAlias = Any

_PURPOSE: Final = "A grid on a Dask cluster"
_PLUGIN: Final = "vkbloom-renderers"
# Submitted runs per worker: one that runs, one that waits.
_AHEAD: Final = 2
# A run is short enough to balance the workers and to render again, long enough to amortize a task.
_RUN_POINTS: Final = 4096
_RUN_BYTES: Final = 64 << 20
_RUNS_A_WORKER: Final = 16
_RETRIES: Final = 2

# The renderer of this process for each choice of adapter, with a lock held while a run uses it.
_held: dict[tuple[str, bool], tuple[Renderer, threading.Lock]] = {}
_held_lock = threading.Lock()


def _renderer(adapter: str, validation: bool) -> tuple[Renderer, threading.Lock]:
    with _held_lock:
        key = (adapter, validation)
        if key not in _held or _held[key][0].closed:
            _held[key] = (Renderer(adapter, validation=validation), threading.Lock())
        return _held[key]


def close_renderers() -> None:
    """Close the renderers of this process, each after its current run."""
    with _held_lock:
        for renderer, lock in _held.values():
            with lock:
                renderer.close()
        _held.clear()


def _plugin() -> Any:
    distributed = import_extra("distributed", "grid", _PURPOSE)

    class Renderers(distributed.WorkerPlugin):  # type: ignore[misc, name-defined]
        """Closes a worker's renderers when the grid or the worker ends."""

        name = _PLUGIN

        async def teardown(self, worker: Any) -> None:
            # Closing waits for the current run; in a thread the worker stays responsive.
            await asyncio.to_thread(close_renderers)

    return Renderers()


@dataclass(frozen=True)
class _Run:
    """The arguments of a task other than the grid."""

    layout: Layout
    writer: Chunks
    blocks: tuple[Block, ...]
    adapter: str
    validation: bool


def _unpickled(pickled: bytes) -> Grid:
    grid: Grid = pickle.loads(pickled)
    return grid


def _lay_out(grid: Grid, adapter: str, validation: bool) -> Layout:
    renderer, lock = _renderer(adapter, validation)
    with lock:
        return lay_out(grid, renderer)


def _refusal(renderer: Renderer, layout: Layout) -> str:
    """Return why this worker's results may differ from the other workers'; "" if they cannot."""
    for what, own in origin(renderer).items():
        if own != getattr(layout, what):
            return (
                f"{what}: the worker's {own} is not the grid's {getattr(layout, what)}; their "
                "pictures may differ, so all workers need the same adapter, driver and version"
            )
    return ""


def _render(grid: Grid, run: _Run) -> Tally | str:
    """Render and write a run's blocks; called in a worker. Text: why this worker may not."""
    renderer, lock = _renderer(run.adapter, run.validation)
    with lock:
        # Returned and not raised, since Dask would repeat the task, perhaps on another worker.
        if refusal := _refusal(renderer, run.layout):
            return refusal
        total = Tally()
        try:
            filler = Filler(grid, run.layout, renderer)
            blocks = written(filler, run.writer, run.blocks, run.layout, total.add)
            run.writer.flush(list(blocks))
        except DeviceLostError:
            # Close it, so that the next attempt creates a new device.
            renderer.close()
            raise
        return total


def check_client(client: Any) -> None:
    """Raise TypeError unless the argument is a synchronous client."""
    distributed = import_extra("distributed", "grid", _PURPOSE)
    if not isinstance(client, distributed.Client):
        raise TypeError(f"client: {client!r} is not a dask.distributed.Client")
    if client.asynchronous:
        raise TypeError("client: it is asynchronous; pass one made with asynchronous=False")


@contextlib.contextmanager
def shared_grid(client: Client, grid: Grid) -> Iterator[Future]:
    """Keep a grid on a cluster, as the result of a task, and the workers' renderers with it.

    Unlike scattered data, the result is computed again if the worker that holds it dies.
    """
    cloudpickle = import_extra("cloudpickle", "grid", _PURPOSE)
    client.register_plugin(_plugin(), name=_PLUGIN)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            shared = client.submit(
                _unpickled, cloudpickle.dumps(grid), pure=False, retries=_RETRIES
            )
        yield shared
    finally:
        client.unregister_worker_plugin(_PLUGIN)


def lay_out_there(client: Client, shared: Future, adapter: str, validation: bool) -> Layout:
    """Lay out a grid on a worker's renderer: the client's machine may have no adapter."""
    layout: Layout = client.submit(
        _lay_out, shared, adapter, validation, pure=False, retries=_RETRIES
    ).result()
    return layout


def _runs(todo: Iterable[Block], layout: Layout, points: int) -> Iterator[tuple[Block, ...]]:
    """Yield runs of neighbouring blocks, each of about `points` points."""
    most = max(1, min(points, _RUN_POINTS, _RUN_BYTES // max(layout.point_size, 1)))
    found: list[Block] = []
    for block in todo:
        found.append(block)
        if sum(one.count for one in found) >= most:
            yield tuple(found)
            found = []
    if found:
        yield tuple(found)


def run_there(
    client: Client,
    shared: Future,
    layout: Layout,
    store: GridStore,
    todo: Iterable[Block],
    *,
    progress: Progress,
    missing: int,
    adapter: str,
    validation: bool,
) -> None:
    """Render blocks on the workers of a cluster."""
    distributed = import_extra("distributed", "grid", _PURPOSE)
    workers = max(1, len(client.nthreads()))
    runs = _runs(todo, layout, math.ceil(missing / (workers * _RUNS_A_WORKER)))
    # The blocks of each submitted run, and the worker that it was meant for.
    under_way: dict[Any, tuple[tuple[Block, ...], str | None]] = {}
    finished = distributed.as_completed()

    def submit() -> None:
        # By itself the scheduler prefers the worker that has the grid. It may choose another one
        # if the worker that is named here has died.
        waiting = dict.fromkeys(client.nthreads() or [None], 0)
        for _, worker in under_way.values():
            if worker in waiting:
                waiting[worker] += 1
        for blocks in itertools.islice(runs, max(0, _AHEAD * len(waiting) - len(under_way))):
            worker = min(waiting, key=waiting.__getitem__)
            waiting[worker] += 1
            run = _Run(layout, store.writer, blocks, adapter, validation)
            future = client.submit(
                _render,
                shared,
                run,
                workers=worker,
                allow_other_workers=worker is not None,
                pure=False,
                retries=_RETRIES,
            )
            under_way[future] = blocks, worker
            finished.add(future)

    def take(future: Any) -> None:
        blocks, _ = under_way.pop(future)
        tally = future.result()
        if isinstance(tally, str):
            raise ValueError(tally)
        progress.add(tally)
        store.mark(blocks)

    try:
        submit()
        for future in finished:
            take(future)
            # The number of workers may have changed.
            submit()
    except BaseException as error:
        _stop(client, under_way, take)
        if isinstance(error, distributed.KilledWorker):
            raise Error(f"client: too many workers died: {error}") from error
        raise


def _stop(client: Client, under_way: Iterable[Any], take: Any) -> None:
    """Mark the runs that are done, and cancel the others."""
    for future in list(under_way):
        if future.status == "finished":
            # Other workers may be refused, too, and a full disk may prevent the marks.
            with contextlib.suppress(OSError, ValueError):
                take(future)
    client.cancel(list(under_way), force=True)
