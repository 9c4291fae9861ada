"""Chunks as they lie in a store, checked before Zarr allocates what they say of their size."""

from __future__ import annotations

from typing import Final

import numpy as np

from vkbloom.checks import import_extra

__all__ = ["check_summed"]

_PURPOSE: Final = "Grids on disk"
_SUM_BYTES: Final = 4
# What Zstandard can make out of a block, the smallest of which has four bytes (RFC 8878, 3.1.1.2).
_MOST_OF_BLOCK: Final = 1 << 17
_LEAST_BLOCK: Final = 4


def check_summed(content: bytes, size: int) -> None:
    """Raise ValueError unless a chunk is complete and ends with its checksum.

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
    if not size:
        return
    if size > (len(content) // _LEAST_BLOCK + 1) * _MOST_OF_BLOCK:
        raise ValueError("it is too short for what it should hold")
    # A chunk that holds less fits into less room.
    if not _fits(content, size) or _fits(content, size - 1):
        raise ValueError(f"it does not hold {size} bytes")


def _fits(content: bytes, room: int) -> bool:
    """Tell whether Zstandard decodes a chunk into so many bytes.

    Without the room, the frame's own header decides how much is allocated.
    """
    zstd = import_extra("numcodecs.zstd", "grid", _PURPOSE)
    try:
        zstd.Zstd().decode(content, np.zeros(room, np.uint8))
    except (RuntimeError, ValueError):
        return False
    return True
