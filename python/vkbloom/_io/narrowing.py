"""Convert numbers to a type with a smaller range: what is beyond it becomes the largest number."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import saturate

#: The largest number of Radiance HDR: 8 bits of mantissa, and exponents to 127.
MAX_RADIANCE: Final = 255 / 256 * 2.0**127
_NAMES: Final = {"float16": "half float", "float32": "float"}


def narrow(values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return floats in another float type; finite ones beyond its range saturate.

    Infinity and NaN stay.
    """
    if values.dtype.kind != "f" or not _is_narrower(values.dtype, dtype):
        return values.astype(dtype, copy=False)
    with np.errstate(over="ignore"):
        made = values.astype(dtype)
    return saturate(made, np.isfinite(values))


def for_radiance(values: NDArray[Any]) -> NDArray[Any]:
    """Return floats as Radiance HDR holds them.

    OpenImageIO's writer makes infinity and NaN 0, and of negative numbers, which the format does
    not have, others: 0.7 of -0.3.
    """
    single = narrow(values, np.dtype(np.float32))
    made: NDArray[Any] = np.nan_to_num(single, nan=0.0, posinf=MAX_RADIANCE, neginf=0.0)
    np.clip(made, 0, np.float32(MAX_RADIANCE), out=made)
    return made


def narrowing_note(values: NDArray[Any], dtype: np.dtype[Any]) -> str | None:
    """Return a note about the values that saturate in another float type, or None."""
    if values.dtype.kind != "f" or not _is_narrower(values.dtype, dtype):
        return None
    # Rounded as the conversion does: 65519 becomes 65504, and 65520 infinity.
    with np.errstate(over="ignore"):
        count = int((np.isinf(values.astype(dtype)) & np.isfinite(values)).sum())
    if not count:
        return None
    limit = f"{np.finfo(dtype).max:.6g}"
    return f"values beyond {limit}, the largest {_NAMES[dtype.name]}, become {limit} ({count})"


def file_note(values: NDArray[Any], dtype: np.dtype[Any], kind: str) -> str | None:
    """Return a note about values that a file cannot hold; `kind`: its format by OpenImageIO."""
    if values.dtype.kind != "f":
        return None
    if dtype.kind == "u":
        is_lossy = not np.isfinite(values).all()
        return "has integers: NaN is written as 0, infinity as 1" if is_lossy else None
    if kind == "hdr":
        limit = values.dtype.type(min(MAX_RADIANCE, float(np.finfo(values.dtype).max)))
        # (NaN is not below the limit, either. Negative values are clipped as in files of integers.)
        if (np.abs(values) <= limit).all():
            return None
        return (
            "is Radiance HDR: NaN is written as 0, infinity and what is beyond as its largest "
            f"number, {MAX_RADIANCE:.3g}"
        )
    note = narrowing_note(values, dtype)
    return None if note is None else f"has numbers of {8 * dtype.itemsize} bits: {note}"


def _is_narrower(old: np.dtype[Any], new: np.dtype[Any]) -> bool:
    return bool(np.finfo(new).max < np.finfo(old).max)
