"""Check the chunks of a store before Zarr allocates the size that their headers claim."""

from __future__ import annotations

from typing import Final

import numpy as np

from vkbloom.checks import import_extra

__all__ = ["check_summed"]

_PURPOSE: Final = "Grids on disk"
_SUM_BYTES: Final = 4
# Largest decompressed and smallest compressed size of a Zstandard block (RFC 8878, 3.1.1.2).
_MOST_OF_BLOCK: Final = 1 << 17
_LEAST_BLOCK: Final = 4


def check_summed(content: bytes, size: int) -> None:
    """Raise ValueError unless a chunk is complete and ends with its checksum.

    Parameters
    ----------
    content : bytes
        The stored bytes: Zstandard data, then its CRC-32C.
    size : int
        Expected size of the decompressed chunk in bytes.
    """
    crc32c = import_extra("google_crc32c", "grid", _PURPOSE)
    content, kept = content[:-_SUM_BYTES], content[-_SUM_BYTES:]
    if crc32c.value(content).to_bytes(_SUM_BYTES, "little") != kept:
        raise ValueError("its checksum differs")
    if not size:
        return
    if size > (len(content) // _LEAST_BLOCK + 1) * _MOST_OF_BLOCK:
        raise ValueError(f"it is too short for {size} bytes")
    # A chunk that decompresses to fewer bytes fits into a smaller buffer too.
    if not _fits(content, size) or _fits(content, size - 1):
        raise ValueError(f"it does not hold {size} bytes")


def _fits(content: bytes, room: int) -> bool:
    """Return whether a chunk decompresses into a buffer of `room` bytes.

    The buffer is given because the frame's own header would otherwise decide how much memory is
    allocated.
    """
    zstd = import_extra("numcodecs.zstd", "grid", _PURPOSE)
    try:
        zstd.Zstd().decode(content, np.zeros(room, np.uint8))
    except (RuntimeError, ValueError):
        return False
    return True
