"""Read-only arrays that are compared and hashed by their values."""

from __future__ import annotations

import base64
import itertools
import math
import operator
import reprlib
import weakref
import zlib
from collections.abc import Mapping
from typing import Any, Final, Self

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom._arrays import plain_array

#: The arrays of this process by names that are never used again: PyTorch compiles with strings as
#: constants, but not with objects.
ARRAYS: Final[weakref.WeakValueDictionary[str, ArrayValue]] = weakref.WeakValueDictionary()
#: Bytes of a stored array. A larger one must not be compressed by more than `MAX_RATIO`: a short
#: text may claim any size, and zeros are compressed to a thousandth.
MAX_BYTES: Final = 1 << 27
MAX_RATIO: Final = 16
_numbers = itertools.count(1)


class ArrayValue:
    """An array of float32 that can be a field of a frozen dataclass.

    `array`: Anything that NumPy can convert, or the result of `to_plain`. It is copied.
    """

    __slots__ = ("__weakref__", "_hash", "array", "name")

    def __init__(self, array: Any, name: str = "array") -> None:
        try:
            plain = _from_plain(array) if isinstance(array, Mapping) else array
            given = plain_array(plain, name)
            if given.dtype.kind not in "biufcO":
                raise TypeError(f"{given.dtype} is not a type of numbers")
            # An array of Python objects raises for complex numbers by itself.
            is_complex = given.dtype.kind == "c"
            with np.errstate(over="ignore"):  # Infinity is refused by its own message.
                values = np.array(given.real, np.float32, order="C")
        except (TypeError, ValueError, OverflowError) as error:
            kind = ValueError if isinstance(error, OverflowError) else type(error)
            what = type(array).__name__
            raise kind(f"{name}: an array is needed, not {what}; NumPy: {error}") from error
        if is_complex:
            raise TypeError(f"{name}: complex numbers are not energies; pass its real part")
        values.flags.writeable = False
        self.array: NDArray[np.float32] = values
        self._hash = hash((values.shape, zlib.crc32(values.tobytes())))
        self.name = f"array {next(_numbers)}"
        ARRAYS[self.name] = self

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.array, dtype=dtype, copy=copy)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ArrayValue):
            return NotImplemented
        return self._hash == other._hash and np.array_equal(self.array, other.array)

    def __hash__(self) -> int:
        return self._hash

    def __reduce__(self) -> tuple[type[Self], tuple[NDArray[np.float32]]]:
        return type(self), (self.array,)

    def __repr__(self) -> str:
        return f"<array of shape {self.array.shape}, {self._hash & 0xFFFFFFFF:08x}>"

    def to_plain(self) -> dict[str, Any]:
        """Return the shape and the compressed values, in a form that JSON can represent."""
        data = zlib.compress(self.array.astype("<f4").tobytes())
        return {"shape": list(self.array.shape), "zlib": base64.b64encode(data).decode("ascii")}


def _from_plain(plain: Mapping[str, Any]) -> NDArray[Any]:
    try:
        packed = base64.b64decode(plain["zlib"], validate=True)
        shape = [operator.index(side) for side in plain["shape"]]
        size = 4 * math.prod(shape)
        if min(shape, default=0) < 0 or size > max(MAX_BYTES, MAX_RATIO * len(packed)):
            raise ValueError(f"{len(packed)} bytes cannot hold the shape {reprlib.repr(shape)}")
        # A byte more than needed shows that there is more.
        data = zlib.decompressobj().decompress(packed, size + 1)
        return np.frombuffer(data, "<f4").reshape(shape)
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        raise ValueError(f"array: not an array's shape and values: {error}") from None
