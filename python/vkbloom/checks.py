"""Checks of what a caller gives: numbers, sizes, times, and the optional packages needed.

Each returns what is to be used, or raises an error that names the argument and what it may be.
"""

from __future__ import annotations

import importlib
import math
import operator
from collections.abc import Iterable, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "FLT_MAX",
    "as_float",
    "check_attachments",
    "check_floats",
    "check_image",
    "check_index",
    "check_number",
    "check_size",
    "check_time",
    "import_extra",
]

#: The largest float of 32 bits, which is what the device computes with.
FLT_MAX = (2 - 2**-23) * 2.0**127

# Fast path for native byte order.
_DTYPES = frozenset(map(np.dtype, (np.uint8, np.float16, np.float32)))


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


def check_image(image: object) -> NDArray[Any]:
    """Return the image, in this machine's byte order, if the core can take it."""
    if not isinstance(image, np.ndarray):
        raise TypeError(f"image: an array is needed, not {type(image).__name__}")
    if type(image) is not np.ndarray and np.ma.is_masked(image):
        raise ValueError("image: some of it is masked; fill it first, such as image.filled(0)")
    if image.dtype not in _DTYPES:
        if image.dtype.name not in ("uint8", "float16", "float32"):
            raise TypeError(f"image: dtype {image.dtype} is not one of uint8, float16, float32")
        image = image.astype(image.dtype.newbyteorder("="), copy=False)
    if image.ndim != 3 or image.shape[2] not in (3, 4) or 0 in image.shape:
        raise ValueError(
            f"image: shape {image.shape} is not (H, W, 3) or (H, W, 4) with sides of at least 1"
        )
    return image


def check_attachments(attachments: str | Sequence[str]) -> tuple[str, ...] | None:
    """Return the wanted names, None for all."""
    if attachments == "all":
        return None
    if isinstance(attachments, str):
        return (attachments,)
    try:
        names = tuple(attachments)
    except TypeError:
        raise TypeError(f"attachments: names are needed, not {attachments!r}") from None
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"attachments: names are needed, not {name!r}")
    return names
