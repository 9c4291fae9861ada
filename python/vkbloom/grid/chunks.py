"""Chunks as they lie in a store, checked before anything believes what they say of their size."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra

__all__ = ["check_numbers", "check_summed", "check_text"]

_PURPOSE: Final = "Grids on disk"
_SUM_BYTES: Final = 4
# What Zstandard can make out of a block, the smallest of which has four bytes (RFC 8878, 3.1.1.2).
_MOST_OF_BLOCK: Final = 1 << 17
_LEAST_BLOCK: Final = 4
# Of a value of an axis in words, such as a list of weights.
_LONGEST_TEXT: Final = 4096


def check_summed(content: bytes, size: int) -> None:
    """Raise ValueError unless a chunk of numbers is whole and has the checksum at its end.

    Parameters
    ----------
    content : bytes
        As in the store: Zstandard, then CRC-32C.
    size : int
        Bytes of the numbers.
    """
    crc32c = import_extra("google_crc32c", "grid", _PURPOSE)
    content, kept = content[:-_SUM_BYTES], content[-_SUM_BYTES:]
    if crc32c.value(content).to_bytes(_SUM_BYTES, "little") != kept:
        raise ValueError("its checksum differs")
    check_numbers(content, size)


def check_numbers(content: bytes, size: int) -> None:
    """Raise ValueError unless a chunk of numbers is whole.

    Parameters
    ----------
    content : bytes
        As in the store: Zstandard.
    size : int
        Bytes of the numbers.
    """
    if not size:
        return
    _decoded(content, size)
    try:
        # A frame that is shorter than its room is no error there.
        _decoded(content, size - 1)
    except ValueError:
        return
    raise ValueError("it holds too little")


def check_text(content: bytes, count: int) -> None:
    """Raise ValueError unless a chunk of text has so many values.

    Parameters
    ----------
    content : bytes
        As in the store: Zstandard, of Zarr's texts of variable length.
    count : int
    """
    texts = _decoded(content, 4 + _LONGEST_TEXT * count, is_exact=False)
    # Zarr makes room for as many as this says.
    if int.from_bytes(texts[:4].tobytes(), "little") != count:
        raise ValueError(f"it does not hold {count} values")


def _decoded(content: bytes, room: int, *, is_exact: bool = True) -> NDArray[np.uint8]:
    """Return what Zstandard makes of a chunk, ValueError where that needs more room."""
    most = (len(content) // _LEAST_BLOCK + 1) * _MOST_OF_BLOCK
    if is_exact and room > most:
        raise ValueError("it is too short for what it should hold")
    zstd: Any = import_extra("numcodecs.zstd", "grid", _PURPOSE)
    # Into memory of a given size: without it, a frame's own words decide how much is taken.
    found = np.zeros(min(room, most), np.uint8)
    try:
        zstd.Zstd().decode(content, found)
    except RuntimeError as error:
        raise ValueError(str(error)) from error
    return found
