"""Checks of what a caller gives: numbers, sizes, times, and the optional packages needed.

Each returns what is to be used, or raises an error that names the argument and what it may be.
"""

from __future__ import annotations

import importlib
import math
import operator
from collections.abc import Iterable
from types import ModuleType
from typing import Any

import numpy as np

__all__ = [
    "FLT_MAX",
    "as_float",
    "check_floats",
    "check_index",
    "check_number",
    "check_size",
    "check_time",
    "import_extra",
]

#: The largest float of 32 bits, which is what the device computes with.
FLT_MAX = (2 - 2**-23) * 2.0**127


def import_extra(package: str, extra: str, purpose: str) -> ModuleType:
    """Import a package that one of vkbloom's extras brings.

    Parameters
    ----------
    package : str
        Its name, such as "OpenImageIO".
    extra : str
        The extra that installs it, such as "images".
    purpose : str
        What needs it, as the subject of the message.

    Returns
    -------
    module
        The package.

    Raises
    ------
    ModuleNotFoundError
        If it is missing; the message gives the command that installs it.
    """
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{purpose} needs {package}: pip install vkbloom[{extra}]", name=error.name
        ) from error


def as_float(name: str, value: Any) -> float:
    """Return a real number as a float, one beyond all floats as infinity, or raise TypeError."""
    try:
        # All of these float() would take, the arrays and complex numbers with a warning.
        no_number = isinstance(value, str | bytes | np.complexfloating)
        if no_number or getattr(value, "ndim", 0) != 0:
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: a number is needed, not {value!r}") from None
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def check_number(name: str, value: float, low: float, high: float) -> float:
    """Return the value as a float if ``low <= value <= high``.

    Else raise ValueError, naming the field and its range, or TypeError where it is no number.
    """
    number = as_float(name, value)
    if not low <= number <= high:
        raise ValueError(f"{name}: {value!r} is out of range, {low:g} to {high:g}")
    return number


def check_floats(name: str, values: Iterable[float]) -> tuple[float, ...]:
    """Return the values as floats that 32 bits hold, else raise TypeError or ValueError."""
    try:
        if isinstance(values, str):
            raise TypeError
        numbers = tuple(as_float(name, value) for value in values)
    except TypeError:
        raise TypeError(f"{name}: a sequence of numbers is needed, not {values!r}") from None
    for number in numbers:
        # The device has 32 bits, of which this is the largest number.
        if not abs(number) <= FLT_MAX:
            raise ValueError(f"{name}: {number!r} is out of range, {-FLT_MAX:g} to {FLT_MAX:g}")
    return numbers


def check_size(name: str, size: Any) -> tuple[int, int]:
    """Return (width, height) as two ints of at least 1, else raise TypeError or ValueError."""
    try:
        width, height = size
        whole = (int(width), int(height))
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name}: (width, height) is needed, not {size!r}") from None
    if whole != (width, height) or min(whole) < 1 or max(whole) >= 2**31:
        raise ValueError(f"{name}: {size!r} is out of range, whole numbers from 1 on")
    return whole


def check_time(time: Any) -> float:
    """Return a time of a scene as a float, else raise TypeError or ValueError."""
    turns = as_float("time", time)
    if not math.isfinite(turns):
        raise ValueError(f"time: {time!r} is out of range, a finite number of turns")
    return turns


def check_index(field: str, value: int, low: int, high: int) -> int:
    """Return a whole number, else raise TypeError or ValueError that names the field."""
    try:
        index = operator.index(value)
    except TypeError:
        raise TypeError(f"{field}: an int is needed, not {type(value).__name__}") from None
    if not low <= index <= high:
        raise ValueError(f"{field}: {index} is outside {low} to {high}")
    return index
