"""Plain PBM files, as OpenImageIO can read them."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

#: How files begin.
PLAIN: Final = b"P1"
# "P1", width and height.
_HEADER: Final = re.compile(rb"P1\s+(\d{1,9})\s+(\d{1,9})\s")


def pack_bitmap(path: str) -> bytes | None:
    """Return a plain PBM file as one of packed bits (P4); None: it is damaged.

    OpenImageIO wants white space between its digits, which Netpbm and GIMP do not write.
    """
    with open(path, "rb") as stream:
        content = re.sub(rb"#[^\r\n]*", b"", stream.read())
    if (header := _HEADER.match(content)) is None:
        return None
    width, height = int(header[1]), int(header[2])
    digits = np.frombuffer(content, np.uint8, offset=header.end())
    digits = digits[~np.isin(digits, np.frombuffer(b" \t\n\v\f\r", np.uint8))][: width * height]
    bits = digits - ord("0")
    if bits.size < max(width * height, 1) or bits.max() > 1:
        return None
    rows = np.packbits(bits.reshape(height, width), axis=1)
    return b"P4\n%d %d\n" % (width, height) + rows.tobytes()
