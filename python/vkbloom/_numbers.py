"""Check numbers: in their range, integers, sizes, times.

Each function returns the number to use, or raises an error that names the argument, its value and
the accepted values.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping, Set
from typing import Any, Final

import numpy as np

from vkbloom._formats import MAX_FLOAT

# What has items, but no first one.
_UNORDERED: Final = (Mapping, Set)


def as_float(name: str, value: Any) -> float:
    """Convert a real number to float, or raise TypeError. Too large a number becomes infinity."""
    try:
        # float() would accept these types, with a warning for arrays and complex numbers.
        is_other = isinstance(value, str | bytes | np.complexfloating)
        if is_other or getattr(value, "ndim", 0) != 0:
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: {value!r} is not a number") from None
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_number(name: str, value: float, low: float, high: float) -> float:
    """Return the value as a float if ``low <= value <= high``.

    Otherwise raise ValueError, naming the field and its range, or TypeError if it is not a number.
    """
    number = as_float(name, value)
    if not low <= number <= high:
        raise ValueError(f"{name}: {value!r} is out of range, {low:g} to {high:g}")
    return number


def check_floats(name: str, values: Iterable[float]) -> tuple[float, ...]:
    """Return the values as floats within the 32-bit range, or raise TypeError or ValueError."""
    try:
        if isinstance(values, (*_UNORDERED, str, bytes)):
            raise TypeError
        numbers = tuple(as_float(name, value) for value in values)
    except TypeError:
        raise TypeError(f"{name}: {values!r} is not a sequence of numbers") from None
    for number in numbers:
        # Negated, so that NaN fails too.
        if not abs(number) <= MAX_FLOAT:
            raise ValueError(f"{name}: {number!r} is out of range, {-MAX_FLOAT:g} to {MAX_FLOAT:g}")
    return numbers


def check_integer(name: str, value: Any, low: float, high: float) -> int:
    """Return a number that is an integer as an int, or raise TypeError or ValueError."""
    integer = int(check_number(name, value, low, high))
    if integer != value:
        raise ValueError(f"{name}: {value!r} is not an integer")
    return integer


def check_above(name: str, value: Any, low: float = 0.0) -> float:
    """Return a finite number above `low` as a float, or raise TypeError or ValueError."""
    number = as_float(name, value)
    if not low < number < math.inf:
        raise ValueError(f"{name}: {value!r} is out of range, above {low:g}")
    return number


def check_index(field: str, value: int, low: int, high: int) -> int:
    """Return an integer, or raise TypeError or ValueError that names the field."""
    try:
        index = operator.index(value)
    except TypeError:
        raise TypeError(f"{field}: {value!r} is not an integer") from None
    if not low <= index <= high:
        raise ValueError(f"{field}: {index} is outside {low} to {high}")
    return index


def check_size(name: str, size: Any) -> tuple[int, int]:
    """Return (width, height) as two ints of at least 1, or raise TypeError or ValueError."""
    try:
        if isinstance(size, _UNORDERED):
            raise TypeError
        width, height = size
        integers = (int(width), int(height))
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name}: {size!r} is not a pair (width, height)") from None
    if integers != (width, height) or min(integers) < 1 or max(integers) >= 2**31:
        raise ValueError(f"{name}: {size!r} is out of range, integers of at least 1")
    return integers


def check_time(time: Any) -> float:
    """Return the time of a scene as a float, or raise TypeError or ValueError."""
    turns = as_float("time", time)
    if not math.isfinite(turns):
        raise ValueError(f"time: {time!r} is out of range, finite numbers")
    return turns
