"""Results that a thread writes while the next one is made."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Final, TypeVar

Result = TypeVar("Result")

#: Seconds after which a wait looks for signals: Python answers one that comes just before a wait
#: without a limit only when that ends.
_SLICE: Final = 0.2


def write_in_background(
    made: Iterable[tuple[Result, Callable[[], object]]],
) -> Generator[Result, None, None]:
    """Yield each result when its function, which a thread calls, has written it.

    An exception of `made` is raised after the results before it are written and yielded.
    """
    with ThreadPoolExecutor(1, "vkbloom-write") as pool:
        # The thread starts before there is something to write: the pool does not wait for one whose
        # start Ctrl-C interrupts.
        pool.submit(lambda: None).result()
        behind: tuple[Result, Future[object]] | None = None
        failure: Exception | None = None
        following = iter(made)
        while True:
            try:
                result, write = next(following)
            except StopIteration:
                break
            except Exception as error:
                failure = error
                break
            if behind is not None:
                _finish(behind[1])
                yield behind[0]
            behind = result, pool.submit(write)
            # The thread has the only references to what it writes.
            del write
        if behind is not None:
            _finish(behind[1])
            yield behind[0]
    if failure is not None:
        raise failure


def _finish(written: Future[object]) -> None:
    """Wait, and raise what the function has raised."""
    while not wait([written], _SLICE).done:
        pass
    written.result()
