"""Images that are read while the device works on another one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final, TypeVar

import click

import vkbloom

__all__ = ["read_ahead", "rendered"]

# Number of images that are read ahead.
_AHEAD: Final = 1

Source = TypeVar("Source")
Read = TypeVar("Read")
# Errors of one image. All others, such as that of a lost device, end the sequence.
_FAILURES: Final = (OSError, TypeError, ValueError, MemoryError)


def read_ahead(read: Callable[[Source], Read], sources: Iterable[Source]) -> Iterator[Read]:
    """Read each source and yield the result; a thread reads the next source at the same time."""
    context = click.get_current_context()

    def read_in_context(source: Source) -> Read:
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
    pictures: Iterable[Read],
    settings: vkbloom.Settings,
    framebuffers: str | list[str],
    prepared: Callable[[Read], Any],
) -> Generator[tuple[Read, vkbloom.Frames | Exception], None, None]:
    """Yield each picture with its frames, or with its error.

    `prepared` makes the renderer's argument of a picture.
    """
    waiting: deque[Read] = deque()
    following = iter(pictures)

    def pixels() -> Iterator[Any]:
        # Those that were taken before the image that failed.
        yield from [prepared(picture) for picture in waiting]
        for picture in following:
            waiting.append(picture)
            yield prepared(picture)

    while True:
        try:
            for frames in renderer.map(pixels(), settings, framebuffers=framebuffers):
                yield waiting.popleft(), frames
            return
        except _FAILURES as error:
            if not waiting:
                raise
            yield waiting.popleft(), error
