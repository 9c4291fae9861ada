"""A renderer for commands: Ctrl-C ends the command without waiting for the device."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from vkbloom._renderer.renderer import Renderer


@contextmanager
def open_renderer(adapter: str) -> Iterator[Renderer]:
    """Open a renderer; if a signal ends the work, close it without waiting for the device."""
    renderer = Renderer(adapter)
    try:
        yield renderer
    except Exception:
        renderer.close()
        raise
    except BaseException:
        # The device finishes its submissions first, which may take many seconds.
        threading.Thread(target=renderer.close, name="vkbloom-close").start()
        raise
    else:
        renderer.close()
