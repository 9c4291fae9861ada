"""Read the gamma that a PNG file states. OpenImageIO rounds it to one decimal place."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from typing import Final

__all__ = ["png_gamma"]

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
# A gAMA chunk holds the exponent of the encoding times this number.
_SCALE: Final = 100_000
# The largest four-byte integer of PNG. 0 is no exponent.
_LARGEST: Final = 2**31 - 1


def png_gamma(path: str | os.PathLike[str]) -> float | None:
    """Return the exponent that decodes a PNG file's colours to light; None if none is stated.

    An sRGB chunk has precedence over a gAMA chunk (PNG, third edition, 4.3). Chunks that are
    damaged, or that follow the palette or the pixels, are ignored.
    """
    stated = None
    for kind, content in _leading_chunks(path):
        if kind == b"sRGB":
            return None
        value = int.from_bytes(content, "big")
        if kind == b"gAMA" and stated is None and len(content) == 4 and 0 < value <= _LARGEST:
            stated = _SCALE / value
    return stated


def _leading_chunks(path: str | os.PathLike[str]) -> Iterator[tuple[bytes, bytes]]:
    """Yield the name and the content of each short chunk before the palette and the pixels."""
    with open(path, "rb") as file:
        if file.read(8) != _SIGNATURE:
            return
        while len(head := file.read(8)) == 8:
            size, kind = int.from_bytes(head[:4], "big"), head[4:]
            if kind in (b"PLTE", b"IDAT") or size > _LARGEST:
                return
            if kind not in (b"gAMA", b"sRGB"):
                file.seek(size + 4, os.SEEK_CUR)
                continue
            content = file.read(min(size, 4))
            file.seek(size - len(content), os.SEEK_CUR)
            if file.read(4) == zlib.crc32(kind + content).to_bytes(4, "big"):
                yield kind, content
