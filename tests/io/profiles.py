"""ICC profiles and PNG files, made byte by byte."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

SRGB_CURVE: Final = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
REC_709: Final = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
DISPLAY_P3: Final = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))
_D65: Final = (0.3127, 0.3290)
_D50: Final = np.array([0.9642, 1.0, 0.8249])
_BRADFORD: Final = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)


def to_xyz(primaries: Any) -> NDArray[np.float64]:
    """Return the matrix from linear RGB with a white of D65 to XYZ (SMPTE RP 177)."""
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in primaries]).T
    x, y = _D65
    white = np.array([x / y, 1, (1 - x - y) / y])
    matrix: NDArray[np.float64] = columns * np.linalg.solve(columns, white)
    return matrix


def curv(*entries: int) -> bytes:
    """Return a curve with a table of 16-bit integers."""
    count = len(entries)
    return b"curv\0\0\0\0" + struct.pack(f">I{count}H", count, *entries)


def para(kind: int, *parameters: float) -> bytes:
    """Return a parametric curve."""
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + b"".join(map(_pack_fixed, parameters))


def profile(
    name: str, primaries: Any, gamma: float | None = None, curve: bytes | None = None
) -> bytes:
    """Return an RGB profile of a matrix and a curve: that of sRGB, a power or the given one."""
    x, y = _D65
    white = _BRADFORD @ np.array([x / y, 1, (1 - x - y) / y])
    adapt = np.linalg.inv(_BRADFORD) @ np.diag(_BRADFORD @ _D50 / white) @ _BRADFORD
    columns = (adapt @ to_xyz(primaries)).T
    if curve is None:
        curve = para(3, *SRGB_CURVE) if gamma is None else para(0, gamma)
    tags = {
        b"desc": _text(name),
        b"cprt": _text("none"),
        b"wtpt": _xyz(_D50),
        **{
            tag: _xyz(column)
            for tag, column in zip((b"rXYZ", b"gXYZ", b"bXYZ"), columns, strict=True)
        },
        **dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), curve),
    }
    return _icc(tags, b"RGB ")


def _icc(tags: dict[bytes, bytes], space: bytes) -> bytes:
    table, body = struct.pack(">I", len(tags)), b""
    start = 128 + 4 + 12 * len(tags)
    for tag, content in tags.items():
        padded = content + bytes(-len(content) % 4)
        table += tag + struct.pack(">II", start + len(body), len(content))
        body += padded
    head = struct.pack(">I4sI4s4s4s", start + len(body), b"", 0x04300000, b"mntr", space, b"XYZ ")
    head += struct.pack(">6H4s", 2024, 1, 1, 0, 0, 0, b"acsp")
    head = head.ljust(68, b"\0") + b"".join(map(_pack_fixed, _D50))
    return head.ljust(128, b"\0") + table + body


def _pack_fixed(value: float) -> bytes:
    return struct.pack(">i", round(value * 65536))


def _xyz(values: Any) -> bytes:
    return b"XYZ \0\0\0\0" + b"".join(map(_pack_fixed, values))


def _text(text: str) -> bytes:
    encoded = text.encode("utf-16-be")
    return b"mluc\0\0\0\0" + struct.pack(">II4sII", 1, 12, b"enUS", len(encoded), 28) + encoded


def png_chunk(kind: bytes, content: bytes) -> bytes:
    """Return a chunk of a PNG file."""
    check = struct.pack(">I", zlib.crc32(kind + content))
    return struct.pack(">I", len(content)) + kind + content + check


def gamma_chunk(gamma: float) -> bytes:
    """Return the chunk that says that values are light to the power of 1 / gamma."""
    return png_chunk(b"gAMA", struct.pack(">I", round(1e5 / gamma)))


def profile_chunk(content: bytes) -> bytes:
    """Return the chunk of an ICC profile."""
    return png_chunk(b"iCCP", b"profile\0\0" + zlib.compress(content))


def store_png(
    path: Path, pixels: NDArray[Any], chunks: bytes = b"", palette: NDArray[Any] | None = None
) -> Path:
    """Write a PNG file of uint8 or uint16, with more chunks; with a palette, (H, W) of indices."""
    height, width = pixels.shape[:2]
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[channels] if palette is None else 3
    if palette is not None:
        chunks += png_chunk(b"PLTE", palette.astype(np.uint8).tobytes())
    lines = pixels.astype(pixels.dtype.newbyteorder(">"))
    content = b"".join(b"\0" + line.tobytes() for line in lines)
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.dtype.itemsize, colour, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + png_chunk(b"IHDR", header)
        + chunks
        + png_chunk(b"IDAT", zlib.compress(content))
        + png_chunk(b"IEND", b"")
    )
    return path
