"""``vkbloom explore``: explore the bloom of an image or a scene in a browser."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import signal
import webbrowser
from collections.abc import Callable
from typing import Any

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom._checks import import_extra
from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.interrupts import INTERRUPTED
from vkbloom._cli.live_options import live_options
from vkbloom._cli.program import as_wrong_use, given
from vkbloom._cli.settings_options import STARTS
from vkbloom._cli.terminal import tell_device
from vkbloom._explorer.viewer import GLOW, Viewer
from vkbloom._settings.settings import SHADINGS, Shading


@click.command(cls=Command)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="Of 127.0.0.1; 0: any free port."
)
@click.option("--open/--no-open", "opens", default=True, help="Whether to open a browser.")
@click.option(
    "--size", type=SIZE, default="1280x720", help="Of a scene's frame, which gives its aspect."
)
@click.option("--shading", type=click.Choice(SHADINGS), default="deferred")
@live_options(image_has_size=False)
def command(
    *,
    image: NDArray[Any] | None,
    origin: dict[str, Any],
    port: int,
    opens: bool,
    size: tuple[int, int],
    shading: Shading,
    adapter: str,
    scene: Callable[[], vkbloom.Scene],
    settings: vkbloom.Settings,
) -> int:
    """Explore the bloom of IMAGE, or of a scene, in a browser with controls for all settings.

    The page is served on 127.0.0.1 until Ctrl-C, to every program that knows its address. IMAGE
    is decoded as vkbloom apply decodes it. The built-in scene has lights 6 times as bright as
    white, unless --glow-intensity says otherwise. Without options of settings, a scene in deferred
    shading begins with the tone map "aces" and the encoding "srgb".
    """
    import_extra("tornado", "notebook", "explore")
    looked_at: vkbloom.Scene | NDArray[Any]
    begun: vkbloom.Settings | None = settings
    if image is not None:
        looked_at = image
    else:
        looked_at = scene()
        if not any(given(name) for name in ("base", "glow", "glow_intensity")):
            looked_at = dataclasses.replace(looked_at, glow_intensity=GLOW)
        if settings == vkbloom.presets["tutorial"] and not any(given(name) for name in STARTS):
            begun = None
    with vkbloom.Renderer(adapter) as renderer:

        def new_viewer() -> Viewer:
            return Viewer(looked_at, begun, size=size, shading=shading, renderer=renderer, **origin)

        with as_wrong_use():
            # Checks the arguments, so that an error appears here and not on the page.
            new_viewer()
        tell_device(renderer)
        try:
            return asyncio.run(_serve(new_viewer, port, opens))
        except KeyboardInterrupt:
            return INTERRUPTED


async def _serve(new_viewer: Callable[[], Viewer], port: int, opens: bool) -> int:
    """Serve the page until a signal comes, and return the exit status."""
    # Imported here because it needs tornado; `command` has checked that it is installed.
    from vkbloom._explorer.server import Server  # noqa: PLC0415

    server = Server(new_viewer, port)
    stopped: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    def stop(status: int) -> None:
        if not stopped.done():
            stopped.set_result(status)

    # Without a handler, KeyboardInterrupt could be raised inside the event loop's own code.
    with contextlib.suppress(NotImplementedError):
        for number, status in ((signal.SIGINT, INTERRUPTED), (signal.SIGTERM, 0)):
            asyncio.get_running_loop().add_signal_handler(number, stop, status)
    click.echo(f"{server.url}\nPress Ctrl-C to stop.")
    if opens:
        webbrowser.open(server.url)
    try:
        return await stopped
    finally:
        await server.stop()
