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

from vkbloom._scene.arrays import MAX_SIDE

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


def _align(size: int) -> int:
    """Round a size in bytes up to a multiple of 4: KTX 1 aligns rows and images to 4 bytes."""
    return (size + 3) & ~3


def read(path: str | os.PathLike[str]) -> tuple[NDArray[Any], ...]:
    """Read all mip levels of a cubemap.

    Returns: one array ``(6, n, n, C)`` for each level, the largest first. The faces are in the
    order +x, -x, +y, -y, +z, -z; C is 3 or 4; the dtype is uint8, float16 or float32. The arrays
    own their memory.
    """
    data = Path(path).read_bytes()
    try:
        order, texel, side, count, offset = _header(data)
        levels: list[NDArray[Any]] = []
        for level in range(count):
            texels, offset = _level(data, offset, (level, max(1, side >> level)), order, texel)
            levels.append(texels.astype(texel[1]))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return tuple(levels)


def _header(data: bytes) -> tuple[Literal["<", ">"], tuple[int, str], int, int, int]:
    """Return byte order, channels and dtype, side, number of levels, and where they begin."""
    if data.startswith(_KTX2_IDENTIFIER):
        raise ValueError("a KTX 2 file; only KTX 1 can be read")
    if not data.startswith(IDENTIFIER):
        raise ValueError("not a KTX 1 file (its identifier does not match)")
    if len(data) < _HEADER_SIZE:
        raise ValueError(f"truncated: {len(data)} bytes, the header alone has 64")
    order: Literal["<", ">"] = (
        "<" if struct.unpack_from("<I", data, 12)[0] == _SAME_ENDIANNESS else ">"
    )
    # Without glTypeSize and glBaseInternalFormat.
    endianness, kind, form, internal, width, height, depth, elements, faces, count, size = (
        struct.unpack_from(f"{order}2I4x2I4x7I", data, 12)
    )
    if endianness != _SAME_ENDIANNESS:
        raise ValueError(f"damaged: its endianness field is {endianness:#010x}")
    if elements or depth > 1:
        raise ValueError(
            f"an array or 3-D texture (depth {depth}, {elements} elements); "
            "a single cubemap is needed"
        )
    if faces != 6:
        raise ValueError(f"has {faces} faces; a cubemap has 6")
    if width != height or not 1 <= width <= MAX_SIDE:
        raise ValueError(f"faces of {width} x {height}; a square of 1..{MAX_SIDE} is needed")
    texel = _TEXELS.get((internal, form, kind))
    if texel is None:
        raise ValueError(
            f"texels of glInternalFormat {internal:#06x}, glFormat {form:#06x}, glType {kind:#06x};"
            " RGBA8, RGB8, RGBA16F, RGB16F, RGBA32F and RGB32F can be read"
        )
    # With 0 the file has only the first level, and the reader has to make the others.
    count = max(count, 1)
    if count > width.bit_length():
        raise ValueError(f"{count} mip levels; {width} x {width} has at most {width.bit_length()}")
    return order, texel, width, count, _HEADER_SIZE + size


def _level(
    data: bytes, offset: int, shape: tuple[int, int], order: str, texel: tuple[int, str]
) -> tuple[NDArray[Any], int]:
    """Return the texels of a level as stored, and the offset of the next; `shape`: number, side."""
    level, side = shape
    channels, kind = texel
    stored = np.dtype(kind).newbyteorder(order)  # type: ignore[arg-type]
    row = _align(side * channels * stored.itemsize)
    face = row * side
    end = offset + 4 + 6 * face
    if end > len(data):
        raise ValueError(f"truncated: level {level} ends at byte {end}, the file has {len(data)}")
    (image_size,) = struct.unpack_from(f"{order}I", data, offset)
    if image_size != face:
        raise ValueError(
            f"damaged: level {level} gives {image_size} bytes a face; {side} x {side} has {face}"
        )
    # Rows are padded to 4 bytes, so faces and levels need no padding.
    texels = np.ndarray(
        (6, side, side, channels),
        stored,
        buffer=data,
        offset=offset + 4,
        strides=(face, row, channels * stored.itemsize, stored.itemsize),
    )
    return texels, end
