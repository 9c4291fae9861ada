"""The server of the explorer's page, and the browser of its tests."""

from __future__ import annotations

import asyncio
import queue
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from vkbloom._explorer.server import Server
from vkbloom._explorer.viewer import Viewer

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE = 60.0  # seconds: waiting costs nothing where a busy machine answers at last


@contextmanager
def served(new_viewer: Callable[[], Viewer]) -> Iterator[str]:
    """Serve the page from a thread, and yield its address."""
    started: queue.Queue[tuple[str, asyncio.AbstractEventLoop, asyncio.Event]] = queue.Queue()

    async def main() -> None:
        server, stopped = Server(new_viewer), asyncio.Event()
        started.put((server.url, asyncio.get_running_loop(), stopped))
        await stopped.wait()
        await server.stop()

    thread = threading.Thread(target=lambda: asyncio.run(main()))
    thread.start()
    url, loop, stopped = started.get(timeout=PATIENCE)
    try:
        yield url
    finally:
        loop.call_soon_threadsafe(stopped.set)
        thread.join()
