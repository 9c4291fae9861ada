"""Results that a thread writes while the next one is made."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Result = TypeVar("Result")


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
                behind[1].result()
                yield behind[0]
            behind = result, pool.submit(write)
            # The thread has the only references to what it writes.
            del write
        if behind is not None:
            behind[1].result()
            yield behind[0]
    if failure is not None:
        raise failure
