"""Images that tests apply bloom to."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def picture(
    width: int, height: int, channels: int = 4, dtype: str = "float32", seed: int = 0
) -> NDArray[Any]:
    """Return random values of 0 to 1; uint8 has them as 0 to 255."""
    values = np.random.default_rng(seed).random((height, width, channels), dtype=np.float32)
    return np.rint(255 * values).astype(dtype) if dtype == "uint8" else values.astype(dtype)


def hdr_picture(width: int, height: int, channels: int, dtype: str, seed: int = 0) -> NDArray[Any]:
    """Return random values, few of them high; floats reach from -0.5 to 7.5.

    Most of what 8 bits hold of its bloom stays under 1.
    """
    values = np.random.default_rng(seed).random((height, width, channels)) ** 2
    if dtype == "uint8":
        return np.rint(255 * values).astype(np.uint8)
    # Beyond what 8 bits hold, and below 0.
    return (8 * values - 0.5).astype(dtype)


def noise_image(*shape: int, dtype: str = "float32", seed: int = 5) -> NDArray[Any]:
    """Return noise of any shape and dtype in 0..1; integers are scaled."""
    values = np.random.default_rng(seed).random(shape)
    if np.dtype(dtype).kind == "u":
        return np.rint(values * np.iinfo(dtype).max).astype(dtype)
    return values.astype(dtype)


def changed(a: NDArray[Any], place: tuple[int, int, int], value: float) -> NDArray[Any]:
    """Return a copy with one value changed."""
    b = a.copy()
    b[place] = value
    return b
