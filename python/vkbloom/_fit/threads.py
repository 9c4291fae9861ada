"""The threads of BLAS."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let BLAS compute in one thread.

    Its other threads wait for work in a loop after each call. These are small here, and on a CPU
    such threads take the cores from the device.
    """
    try:
        import threadpoolctl  # noqa: PLC0415  an extra
    except ModuleNotFoundError:  # only time is lost
        yield
        return
    with threadpoolctl.threadpool_limits(1, user_api="blas"):
        yield
