"""Locks that stay usable in a forked process: a thread of its parent that it lacks may hold one."""

from __future__ import annotations

import functools
import os
import threading
import weakref
from collections.abc import Callable
from typing import Any, Final, TypeVar

_Value = TypeVar("_Value")
_locks: Final[weakref.WeakSet[ProcessLock]] = weakref.WeakSet()
_properties: Final[list[Any]] = []


class ProcessLock:
    """A lock that a thread can take again, such as that of a module or of an object.

    A forked process has a new one, which is free.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        _locks.add(self)

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *exception: object) -> None:
        self._lock.release()


class cached_property(functools.cached_property[_Value]):
    """`functools.cached_property`, which in Python 3.11 has a lock for all objects of a class."""

    def __init__(self, function: Callable[[Any], _Value]) -> None:
        super().__init__(function)
        if hasattr(self, "lock"):
            _properties.append(self)


def _renew() -> None:
    for lock in list(_locks):
        lock._lock = threading.RLock()
    for one in _properties:
        one.lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew)
