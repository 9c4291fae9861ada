"""Render a grid into a sink, in this process or on a cluster."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from vkbloom.grid.filling import Tally
from vkbloom.grid.layout import Grid, Layout, lay_out
from vkbloom.grid.progress import Progress
from vkbloom.grid.running import Sink, run_here
from vkbloom.interruptible import opened_renderer
from vkbloom.renderer import Renderer

__all__ = ["render_grid"]


def render_grid(
    grid: Grid,
    prepared: Callable[[Layout], Sink],
    *,
    client: Any,
    adapter: str,
    validation: bool,
    progress: bool | None,
) -> Tally:
    """Render the points of a grid that are not done.

    `client`: None: this process renders.
    """
    with ExitStack() as stack:
        renderer: Renderer | None = None
        if client is None:
            renderer = stack.enter_context(opened_renderer(adapter, validation))
            layout = lay_out(grid, renderer)
        else:
            from vkbloom.grid import cluster  # noqa: PLC0415  Dask is optional

            cluster.check_client(client)
            shared = stack.enter_context(cluster.shared_grid(client, grid))
            layout = cluster.lay_out_there(client, shared, adapter, validation)
        sink = prepared(layout)
        done = int(sink.done.sum())
        shown = stack.enter_context(Progress(sink.total, done, shown=progress))
        if done < sink.total:
            shown.add(Tally(ran=layout.ran))
        if renderer is not None:
            run_here(grid, layout, sink, sink.missing(), renderer=renderer, progress=shown)
        else:
            cluster.run_there(
                client,
                shared,
                layout,
                sink,
                sink.missing(),
                progress=shown,
                missing=sink.total - done,
                adapter=adapter,
                validation=validation,
            )
        sink.finish()
    return shown.tally
