"""Reader of KTX 1 cubemaps with uncompressed texels.

Source of the layout and of the numbers: "KTX File Format Specification", version 1.0, Khronos
Group; the OpenGL enumerants are those of the OpenGL registry.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

IDENTIFIER: Final = b"\xabKTX 11\xbb\r\n\x1a\n"
_KTX2_IDENTIFIER: Final = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEADER_SIZE: Final = 64
_SAME_ENDIANNESS: Final = 0x04030201

# (glInternalFormat, glFormat, glType) -> channels, dtype
_TEXELS: Final[dict[tuple[int, int, int], tuple[int, str]]] = {
    (0x8058, 0x1908, 0x1401): (4, "u1"),  # RGBA8
    (0x8051, 0x1907, 0x1401): (3, "u1"),  # RGB8
    (0x881A, 0x1908, 0x140B): (4, "f2"),  # RGBA16F
    (0x881B, 0x1907, 0x140B): (3, "f2"),  # RGB16F
    (0x8814, 0x1908, 0x1406): (4, "f4"),  # RGBA32F
    (0x8815, 0x1907, 0x1406): (3, "f4"),  # RGB32F
}


def _aligned(size: int) -> int:
    """Round a size in bytes up to a multiple of 4: KTX 1 aligns rows and images to 4 bytes."""
    return (size + 3) & ~3


def read(path: str | os.PathLike[str]) -> tuple[NDArray[Any], ...]:
    """Read all mip levels of a cubemap.

    Returns: one array ``(6, n, n, C)`` for each level, the largest first. The faces are in the
    order +x, -x, +y, -y, +z, -z; C is 3 or 4; the dtype is uint8, float16 or float32. The arrays
    own their memory.
    """
    path = Path(path)
    data = path.read_bytes()
    if data.startswith(_KTX2_IDENTIFIER):
        raise ValueError(f"{path}: a KTX 2 file; only KTX 1 can be read")
    if not data.startswith(IDENTIFIER):
        raise ValueError(f"{path}: not a KTX 1 file (its identifier does not match)")
    if len(data) < _HEADER_SIZE:
        raise ValueError(f"{path}: truncated: {len(data)} bytes, the header alone has 64")
    order: Literal["<", ">"] = (
        "<" if struct.unpack_from("<I", data, 12)[0] == _SAME_ENDIANNESS else ">"
    )
    (
        endianness,
        gl_type,
        _type_size,
        gl_format,
        gl_internal_format,
        _base_internal_format,
        width,
        height,
        depth,
        elements,
        faces,
        level_count,
        key_value_size,
    ) = struct.unpack_from(f"{order}13I", data, 12)
    if endianness != _SAME_ENDIANNESS:
        raise ValueError(f"{path}: damaged: its endianness field is {endianness:#010x}")
    if elements or depth > 1:
        raise ValueError(
            f"{path}: an array or 3-D texture (depth {depth}, {elements} elements); "
            "a single cubemap is needed"
        )
    if faces != 6:
        raise ValueError(f"{path}: has {faces} faces; a cubemap has 6")
    if width != height or width == 0:
        raise ValueError(f"{path}: faces of {width} x {height}; they must be square")
    texel = _TEXELS.get((gl_internal_format, gl_format, gl_type))
    if texel is None:
        raise ValueError(
            f"{path}: texels of glInternalFormat {gl_internal_format:#06x}, glFormat "
            f"{gl_format:#06x}, glType {gl_type:#06x}; RGBA8, RGB8, RGBA16F, RGB16F, RGBA32F "
            "and RGB32F can be read"
        )
    # With 0 the file has only the first level, and the reader has to make the others.
    level_count = max(level_count, 1)
    if level_count > width.bit_length():
        raise ValueError(
            f"{path}: {level_count} mip levels; {width} x {width} has at most {width.bit_length()}"
        )

    channels, kind = texel
    stored = np.dtype(kind).newbyteorder(order)
    offset = _HEADER_SIZE + key_value_size
    levels: list[NDArray[Any]] = []
    for level in range(level_count):
        side = max(1, width >> level)
        row = _aligned(side * channels * stored.itemsize)
        face = row * side
        if offset + 4 + 6 * face > len(data):
            raise ValueError(
                f"{path}: truncated: level {level} ends at byte {offset + 4 + 6 * face}, "
                f"the file has {len(data)}"
            )
        (image_size,) = struct.unpack_from(f"{order}I", data, offset)
        if image_size != face:
            raise ValueError(
                f"{path}: damaged: level {level} gives {image_size} bytes a face; "
                f"{side} x {side} has {face}"
            )
        # Rows are padded to 4 bytes, so faces and levels need no padding.
        texels = np.ndarray(
            (6, side, side, channels),
            stored,
            buffer=data,
            offset=offset + 4,
            strides=(face, row, channels * stored.itemsize, stored.itemsize),
        )
        levels.append(texels.astype(stored.newbyteorder("=")))
        offset += 4 + 6 * face
    return tuple(levels)
