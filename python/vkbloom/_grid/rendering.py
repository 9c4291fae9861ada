"""Render a grid into a store, in this process or on a cluster."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, NamedTuple

from vkbloom._grid.filling import Tally
from vkbloom._grid.layout import Grid, Layout, lay_out
from vkbloom._grid.progress import Progress
from vkbloom._grid.running import run_here
from vkbloom._grid.store import GridStore
from vkbloom._renderer.renderer import Renderer


class Workers(NamedTuple):
    """The workers of a Dask cluster, and the arguments of the renderers that they open."""

    client: Any
    adapter: str
    validation: bool


def render_grid(
    grid: Grid,
    prepared: Callable[[Layout], GridStore],
    by: Renderer | Workers,
    *,
    progress: bool | None,
) -> Tally:
    """Render the points of a grid that are not done."""
    with ExitStack() as stack:
        if isinstance(by, Renderer):
            layout = lay_out(grid, by)
        else:
            from vkbloom._grid import cluster  # noqa: PLC0415  Dask is optional

            cluster.check_client(by.client)
            shared = stack.enter_context(cluster.shared_grid(by.client, grid))
            layout = cluster.lay_out_there(by.client, shared, by.adapter, by.validation)
        store = prepared(layout)
        done = int(store.done.sum())
        shown = stack.enter_context(Progress(store.total, done, shown=progress))
        if done < store.total:
            shown.add(Tally(ran=layout.ran))
        if isinstance(by, Renderer):
            run_here(grid, layout, store, store.missing(), renderer=by, progress=shown)
        else:
            cluster.run_there(
                by.client,
                shared,
                layout,
                store,
                store.missing(),
                progress=shown,
                missing=store.total - done,
                adapter=by.adapter,
                validation=by.validation,
            )
        store.finish()
    return shown.tally
