"""Image files as other programs write them, made byte by byte."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

BGRA = (0xFF0000, 0xFF00, 0xFF, 0xFF000000)


def bmp(path: Path, words: NDArray[Any], size: int = 40, masks: tuple[int, ...] = ()) -> None:
    """Write a BMP file of 32 bits from (H, W) words; `size`: that of its header."""
    height, width = words.shape
    # BI_BITFIELDS or BI_RGB. A header of 40 bytes has the masks behind it.
    head = struct.pack("<IiiHHIIiiII", size, width, height, 1, 32, 3 if masks else 0, *[0] * 5)
    listed = struct.pack(f"<{len(masks)}I", *masks)
    head = (head + listed).ljust(size, b"\0") if size > 40 else head + listed
    pixels = words[::-1].astype("<u4").tobytes()
    start = 14 + len(head)
    path.write_bytes(
        struct.pack("<2sIHHI", b"BM", start + len(pixels), 0, 0, start) + head + pixels
    )


def tga(path: Path, pixels: NDArray[Any], kind: int | None, bits: int = 8) -> None:
    """Write a Targa file of (H, W, 4); `kind`: the attributes type of version 2, if it is one."""
    height, width = pixels.shape[:2]
    # Rows from the top; `bits` of alpha.
    head = struct.pack("<3B2HB4H2B", 0, 0, 2, 0, 0, 0, 0, 0, width, height, 32, 0x20 | bits)
    content = head + pixels[:, :, [2, 1, 0, 3]].tobytes()
    if kind is not None:
        area = struct.pack("<H", 495).ljust(494, b"\0") + bytes([kind])
        footer = struct.pack("<II", len(content), 0) + b"TRUEVISION-XFILE.\0"
        content += area + footer
    path.write_bytes(content)


def dds(path: Path, pixels: NDArray[Any], mode: int) -> None:
    """Write a DDS file of (H, W, 4) with a header of DirectX 10; `mode`: that of alpha."""
    height, width = pixels.shape[:2]
    head = struct.pack("<4s7I44x", b"DDS ", 124, 0x100F, height, width, 4 * width, 0, 1)
    head += struct.pack("<2I4s5I", 32, 4, b"DX10", *[0] * 5) + struct.pack(
        "<5I", 0x1000, 0, 0, 0, 0
    )
    # DXGI_FORMAT_R8G8B8A8_UNORM, a texture of two dimensions.
    path.write_bytes(head + struct.pack("<5I", 28, 3, 0, 1, mode) + pixels.tobytes())


def radiance(path: Path, pixels: NDArray[Any], axes: str, lines: str = "") -> None:
    """Write a Radiance file from upright (H, W, 4) of RGBE, along axes such as "+X-Y"."""
    if axes[1] == "X":
        pixels = pixels.swapaxes(0, 1)
    # Y increases upwards.
    signs = [1 if axis in ("+X", "-Y") else -1 for axis in (axes[:2], axes[2:])]
    pixels = pixels[:: signs[0], :: signs[1]]
    line = f"{axes[:2]} {pixels.shape[0]} {axes[2:]} {pixels.shape[1]}"
    head = f"#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n{line}\n"
    path.write_bytes(head.encode() + pixels.tobytes())


def xmp(orientation: int, *, is_element: bool = False) -> str:
    """Return a packet of XMP, with the orientation as an attribute or an element."""
    name, value = "tiff:Orientation", orientation
    message = (f">\n<{name}>{value}</{name}>", "") if is_element else (f' {name}="{value}">', "")
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/">'
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        '<rdf:Description rdf:about="" xmlns:tiff="http://ns.adobe.com/tiff/1.0/"'
        f"{message[0]}</rdf:Description></rdf:RDF></x:xmpmeta>"
    )


def fits(path: Path, pixels: NDArray[Any], **cards: object) -> None:
    """Write a FITS file of (H, W) or planes (C, H, W), bottom row first, with further lines."""
    bits = {"u1": 8, "i2": 16, "i4": 32, "f4": -32}[pixels.dtype.str[1:]]
    sides = {f"NAXIS{axis}": side for axis, side in enumerate(pixels.shape[::-1], 1)}
    listed = {"SIMPLE": "T", "BITPIX": bits, "NAXIS": pixels.ndim, **sides, **cards}
    lines = [f"{name:8}= {value!s:>20}" for name, value in listed.items()]
    head = "".join(line.ljust(80) for line in (*lines, "END"))
    body = pixels.astype(pixels.dtype.newbyteorder(">")).tobytes()
    path.write_bytes(_blocks(head.encode(), b" ") + _blocks(body, b"\0"))


def _blocks(content: bytes, fill: bytes) -> bytes:
    return content.ljust(-(-len(content) // 2880) * 2880, fill)


def grey_psd(path: Path, picture: NDArray[Any], layer: NDArray[Any]) -> None:
    """Write a Photoshop file of grey and alpha, (H, W, 2), with a layer at x = 2, y = 1."""
    bits = 8 * picture.dtype.itemsize
    height, width = picture.shape[:2]
    planes = [
        struct.pack(">H", 0) + layer[..., channel].astype(f">u{bits // 8}").tobytes()
        for channel in (0, 1)
    ]
    # Channel -1 is alpha. A count below 0: the picture has the alpha of all layers.
    rows, columns = layer.shape[:2]
    info = struct.pack(">hiiiiH", -1, 1, 2, 1 + rows, 2 + columns, 2)
    info += struct.pack(">hIhI", 0, len(planes[0]), -1, len(planes[1]))
    info += b"8BIMnorm\xff\0\0\0" + struct.pack(">III4s", 12, 0, 0, b"\2L1\0") + b"".join(planes)
    info += bytes(len(info) % 2)
    section = struct.pack(">I", len(info)) + info + bytes(4)
    merged = np.moveaxis(picture, -1, 0).astype(f">u{bits // 8}").tobytes()
    path.write_bytes(
        struct.pack(">4sH6xHIIHH", b"8BPS", 1, 2, height, width, bits, 1)
        + bytes(8)
        + struct.pack(">I", len(section))
        + section
        + bytes(2)
        + merged
    )


def jpeg_xl_box(kind: bytes, content: bytes) -> bytes:
    """Return a box of a JPEG XL container."""
    return struct.pack(">I4s", 8 + len(content), kind) + content
