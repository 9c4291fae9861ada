"""Read the gamma that a PNG file states. OpenImageIO rounds it to one decimal place."""

from __future__ import annotations

import os
from typing import Final

from vkbloom._io.containers import png_chunks

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
    with open(path, "rb") as stream:
        for kind, content in png_chunks(stream, (b"gAMA", b"sRGB")):
            if kind in (b"PLTE", b"IDAT"):
                break
            if kind == b"sRGB" and content is not None:
                return None
            value = int.from_bytes(content or b"", "big")
            if stated is None and len(content or b"") == 4 and 0 < value <= _LARGEST:
                stated = _SCALE / value
    return stated
