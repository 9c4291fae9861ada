"""Check arguments: numbers, sizes, times, images, and the optional packages they need.

Each function returns the value to use, or raises an error that names the argument, its value and
the accepted values.
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

#: The largest 32-bit float; the device computes in 32-bit floats.
FLT_MAX = (2 - 2**-23) * 2.0**127

# Fast path for native byte order.
_DTYPES = frozenset(map(np.dtype, (np.uint8, np.float16, np.float32)))


def import_extra(package: str, extra: str, purpose: str) -> ModuleType:
    """Import a package that one of vkbloom's extras installs.

    Parameters
    ----------
    package : str
        Name of the package, such as "OpenImageIO".
    extra : str
        The extra that installs it, such as "images".
    purpose : str
        What needs the package; the subject of the error message.

    Returns
    -------
    module
        The package.

    Raises
    ------
    ModuleNotFoundError
        The package is missing; the message gives the command that installs it.
    """
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{purpose} needs {package}: pip install vkbloom[{extra}]", name=error.name
        ) from error


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
        if isinstance(values, str):
            raise TypeError
        numbers = tuple(as_float(name, value) for value in values)
    except TypeError:
        raise TypeError(f"{name}: {values!r} is not a sequence of numbers") from None
    for number in numbers:
        # Negated, so that NaN fails too.
        if not abs(number) <= FLT_MAX:
            raise ValueError(f"{name}: {number!r} is out of range, {-FLT_MAX:g} to {FLT_MAX:g}")
    return numbers


def check_size(name: str, size: Any) -> tuple[int, int]:
    """Return (width, height) as two ints of at least 1, or raise TypeError or ValueError."""
    try:
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


def check_index(field: str, value: int, low: int, high: int) -> int:
    """Return an integer, or raise TypeError or ValueError that names the field."""
    try:
        index = operator.index(value)
    except TypeError:
        raise TypeError(f"{field}: {value!r} is not an integer") from None
    if not low <= index <= high:
        raise ValueError(f"{field}: {index} is outside {low} to {high}")
    return index


def check_image(image: object) -> NDArray[Any]:
    """Return the image in native byte order if the core supports it, or raise an error."""
    if not isinstance(image, np.ndarray):
        raise TypeError(f"image: {type(image).__name__} is not a NumPy array")
    if type(image) is not np.ndarray and np.ma.is_masked(image):
        raise ValueError(
            "image: it has masked values; fill them first, for example with image.filled(0)"
        )
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
    """Return the names of the requested framebuffers; None for all."""
    if attachments == "all":
        return None
    if isinstance(attachments, str):
        return (attachments,)
    try:
        names = tuple(attachments)
    except TypeError:
        raise TypeError(f"attachments: {attachments!r} is not a sequence of names") from None
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"attachments: {name!r} is not a name")
    return names
