"""Keeps arrays that take long to make: bounded by bytes, and only while a renderer is open."""

from __future__ import annotations

import functools
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, Final, Generic, Protocol, TypeVar, cast

from vkbloom._locks import ProcessLock

#: The bound while a renderer is open, as that of the core's images. The last array that was made
#: stays whatever its size, since a plan holds it anyway.
OPEN_BYTES: Final = 256 << 20
#: The bound of small arrays that stay in the process, such as masks of apertures.
CLOSED_BYTES: Final = 16 << 20


class _Sized(Protocol):
    @property
    def nbytes(self) -> int: ...


_Made = TypeVar("_Made", bound=_Sized)


class ArrayCache:
    """Arrays by the arguments of the function that made them, the oldest of which are dropped.

    - `most`: The bound in bytes.
    - `last`: How many arrays stay even if they are larger.
    """

    def __init__(self, most: int, last: int) -> None:
        self._most, self._last = most, last
        self._arrays: OrderedDict[Hashable, _Sized] = OrderedDict()
        self._lock = ProcessLock()

    @property
    def nbytes(self) -> int:
        """The bytes of all arrays."""
        return sum(array.nbytes for array in self._arrays.values())

    def find(self, key: Hashable) -> _Sized | None:
        """Return an array, which becomes the newest one."""
        with self._lock:
            array = self._arrays.pop(key, None)
            if array is not None:
                self._arrays[key] = array
            return array

    def add(self, key: Hashable, array: _Sized) -> None:
        """Add the newest array."""
        with self._lock:
            self._arrays[key] = array
            while len(self._arrays) > self._last and self.nbytes > self._most:
                self._arrays.popitem(last=False)


_IN_PROCESS: Final = ArrayCache(CLOSED_BYTES, 0)
_SHARING: Final = ProcessLock()
_of_renderers: Callable[[], ArrayCache | None] = lambda: None  # noqa: E731  a dead reference


def shared_cache() -> ArrayCache:
    """Return the arrays of the open renderers, each of which holds them until it is closed."""
    global _of_renderers  # noqa: PLW0603  a weak reference: the renderers are the owners
    with _SHARING:
        arrays = _of_renderers()
        if arrays is None:
            arrays = ArrayCache(OPEN_BYTES, 1)
            _of_renderers = weakref.ref(arrays)
    return arrays


class keep(Generic[_Made]):
    """Keeps the results of a function of hashable arguments."""

    def __init__(self, make: Callable[..., _Made]) -> None:
        functools.update_wrapper(self, make)
        self._make = make

    def __call__(self, *arguments: Any) -> _Made:
        array = self.find(*arguments)
        if array is None:
            array = self._make(*arguments)
            _arrays().add((self._make, arguments), array)
        return array

    def find(self, *arguments: Any) -> _Made | None:
        """Return the result of a call with these arguments, if it is kept."""
        return cast("_Made | None", _arrays().find((self._make, arguments)))


def _arrays() -> ArrayCache:
    return _of_renderers() or _IN_PROCESS
