"""Locks that stay usable in a forked process."""

from __future__ import annotations

import os
import threading


class ProcessLock:
    """A lock that a thread can take again, for the life of the process, such as that of a module.

    A forked process has a new one: a thread of its parent that it lacks may have held the lock.
    """

    def __init__(self) -> None:
        self._renew()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._renew)

    def _renew(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *exception: object) -> None:
        self._lock.release()
