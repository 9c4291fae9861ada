"""A browser, and a server of the explorer's page."""

from __future__ import annotations

import asyncio
import inspect
import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import pytest

from tests.explorer.explorer_hosts import CHROMIUM, PATIENCE
from tests.explorer.pages import Server, Viewer

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test that is a coroutine in the event loop of its fixtures."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    given = {
        name: pyfuncitem.funcargs[name] for name in inspect.signature(pyfuncitem.obj).parameters
    }
    loop: Any = pyfuncitem.funcargs["loop"]
    loop.run(pyfuncitem.obj(**given))
    return True


@contextmanager
def serve_page(new_viewer: Callable[[], Viewer]) -> Iterator[str]:
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


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # Without a sandbox, which root has not; nothing but our own pages is opened. Without the
        # screen's colours, so that a screenshot holds what was drawn.
        arguments = ["--no-sandbox", "--force-color-profile=srgb"]
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def serve() -> Iterator[Callable[[Callable[[], Viewer]], str]]:
    """Serves viewers from a thread, and returns where."""
    with ExitStack() as stack:
        yield lambda new_viewer: stack.enter_context(serve_page(new_viewer))
