"""Copies of image files that OpenImageIO cannot read as they are."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import numpy as np

from vkbloom._io import jpeg_xl

_PLAIN: Final = b"P1"
# "P1", width and height.
_PLAIN_HEADER: Final = re.compile(rb"P1\s+(\d{1,9})\s+(\d{1,9})\s")


@contextmanager
def readable(path: str | os.PathLike[str]) -> Iterator[str]:
    """Yield a file to open in place of a file, which is a copy where OpenImageIO needs another one.

    These are some files of JPEG XL, and plain PBM.
    """
    name, content, suffix = os.fspath(path), None, ".jxl"
    if os.path.isfile(name):
        content = jpeg_xl.readable_content(name)
        if content is None:
            content, suffix = _packed_bitmap(name), ".pbm"
    if content is None:
        yield name
        return
    with tempfile.NamedTemporaryFile(suffix=suffix) as file:
        file.write(content)
        file.flush()
        yield file.name


def _packed_bitmap(path: str) -> bytes | None:
    """Return a plain PBM file as one of packed bits (P4); None for other and for damaged files.

    OpenImageIO wants white space between its digits, which Netpbm and GIMP do not write.
    """
    with open(path, "rb") as stream:
        if stream.read(len(_PLAIN)) != _PLAIN:
            return None
        content = re.sub(rb"#[^\r\n]*", b"", _PLAIN + stream.read())
    if (header := _PLAIN_HEADER.match(content)) is None:
        return None
    width, height = int(header[1]), int(header[2])
    digits = np.frombuffer(content, np.uint8, offset=header.end())
    digits = digits[~np.isin(digits, np.frombuffer(b" \t\n\v\f\r", np.uint8))][: width * height]
    bits = digits - ord("0")
    if bits.size < max(width * height, 1) or bits.max() > 1:
        return None
    rows = np.packbits(bits.reshape(height, width), axis=1)
    return b"P4\n%d %d\n" % (width, height) + rows.tobytes()
