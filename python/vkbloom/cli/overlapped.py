"""Sequences of images, which are read while the device works on another image."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final, TypeVar

import click

import vkbloom
from vkbloom.io.images import Picture

__all__ = ["read_ahead", "rendered"]

# Number of images that are read ahead.
_AHEAD: Final = 1

Read = TypeVar("Read")


def read_ahead(read: Callable[[str], Read], sources: Iterable[str]) -> Iterator[Read]:
    """Read each source and yield the result; a thread reads the next source at the same time."""
    context = click.get_current_context()

    def read_in_context(source: str) -> Read:
        with context.scope(cleanup=False):
            return read(source)

    pool = ThreadPoolExecutor(1, "vkbloom-read")
    try:
        ahead: deque[Future[Read]] = deque()
        for source in sources:
            ahead.append(pool.submit(read_in_context, source))
            if len(ahead) > _AHEAD:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def rendered(
    renderer: vkbloom.Renderer,
    pictures: Iterable[Picture],
    settings: vkbloom.Settings,
    attachments: str | list[str],
    prepared: Callable[[Picture], Any],
) -> Generator[tuple[Picture, vkbloom.Frames], None, None]:
    """Yield each picture with its frames; `prepared` makes the renderer's argument of it."""
    waiting: deque[Picture] = deque()

    def pixels() -> Iterator[Any]:
        for picture in pictures:
            waiting.append(picture)
            yield prepared(picture)

    for frames in renderer.apply_each(pixels(), settings, attachments=attachments):
        yield waiting.popleft(), frames
