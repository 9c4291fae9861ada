"""Image files as other programs write them, made byte by byte."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

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


def radiance(path: Path, pixels: NDArray[Any], axes: str) -> None:
    """Write a Radiance file from upright (H, W, 4) of RGBE, along axes such as "+X-Y"."""
    if axes[1] == "X":
        pixels = pixels.swapaxes(0, 1)
    # Y increases upwards.
    signs = [1 if axis in ("+X", "-Y") else -1 for axis in (axes[:2], axes[2:])]
    pixels = pixels[:: signs[0], :: signs[1]]
    line = f"{axes[:2]} {pixels.shape[0]} {axes[2:]} {pixels.shape[1]}"
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{line}\n"
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
