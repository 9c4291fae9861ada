"""Find what OpenImageIO's readers leave out of image files: chunks, fields and packets."""

from __future__ import annotations

import os
import re
import struct
import tempfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

#: What to do with AVIF and HEIF.
HEIF_ADVICE: Final = (
    "this OpenImageIO is built without libheif, which reads AVIF and HEIF; convert the file to "
    "PNG, HEIF by pillow-heif"
)
# Brands of ISO base media files: of ISO/IEC 23008-12 and of AVIF.
_HEIF_BRANDS: Final = b"avif avis heic heix hevc heim heis hevx mif1 msf1".split()

# A codestream or a container (ISO/IEC 18181-2).
_JPEG_XL: Final = (b"\xff\x0a", b"\0\0\0\x0cJXL \r\n\x87\n")
_JPEG_XL_BYTES: Final = 128
_PNG_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
# The largest four-byte integer of PNG.
_LARGEST_CHUNK: Final = 2**31 - 1
# A gAMA chunk holds the exponent of the encoding times this number; 0 is no exponent.
_GAMMA_SCALE: Final = 100_000
# Metadata in bytes: a damaged file may claim more.
_LARGEST_PACKET: Final = 1 << 24
# The field types of TIFF 6.0 that are read: bytes, text, SHORT, LONG and undefined bytes.
_TIFF_TYPES: Final[Mapping[int, str]] = {1: "u1", 2: "u1", 3: "u2", 4: "u4", 7: "u1"}
_ORIENTATION: Final = 274
_XMP: Final = 700
_XMP_OF_JPEG: Final = b"http://ns.adobe.com/xap/1.0/\0"
_XMP_OF_PNG: Final = b"XML:com.adobe.xmp\0"
# Of an attribute or an element (XMP specification part 1, 7).
_IN_XMP: Final = re.compile(rb"tiff:Orientation\s*(?:=\s*[\"']|>)\s*([1-8])\b")
# Exif's orientation by a Radiance resolution line: the axis of the scanlines comes first, and "-Y"
# runs downwards. OpenImageIO 3.2 exchanges 6 and 8.
_RADIANCE: Final = (b"-Y+X", b"-Y-X", b"+Y-X", b"+Y+X", b"+X-Y", b"-X-Y", b"-X+Y", b"+X+Y")
_RESOLUTION: Final = re.compile(rb"\n\n([-+][XY])\s*\d+\s*([-+][XY])\s*\d+\s*\n")


def orientation_of(path: str | os.PathLike[str], kind: str, stated: Any) -> int:
    """Return the orientation of an image file, 1 to 8 as in Exif."""
    stated = stated if isinstance(stated, int) else None
    if kind == "hdr" or (stated is None and kind in _FINDERS):
        with open(path, "rb") as stream:
            stored = _FINDERS[kind](stream)
            stated = stated if stored is None else stored
    if kind in ("dpx", "cineon") and stated in (5, 6, 7, 8):
        # OpenImageIO exchanges width and height before it reads the lines.
        raise ValueError(f"{os.fspath(path)}: {kind} with lines along the columns is not supported")
    return stated if stated is not None and 1 <= stated <= 8 else 1


def upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Undo an orientation of TIFF 6.0 and Exif, 1 to 8: the sides of the first row and column."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


@contextmanager
def padded(path: str | os.PathLike[str]) -> Iterator[str]:
    """Yield a file to open in place of a file: OpenImageIO needs 128 bytes of JPEG XL."""
    name, content = os.fspath(path), b""
    if os.path.isfile(name) and os.path.getsize(name) < _JPEG_XL_BYTES:
        with open(name, "rb") as stream:
            content = stream.read()
    if not content.startswith(_JPEG_XL):
        yield name
        return
    with tempfile.NamedTemporaryFile(suffix=".jxl") as file:
        file.write(content.ljust(_JPEG_XL_BYTES, b"\0"))
        file.flush()
        yield file.name


def png_chunks(stream: BinaryIO, wanted: tuple[bytes, ...]) -> Iterator[tuple[bytes, bytes | None]]:
    """Yield the name of each chunk, with the content of undamaged chunks of the wanted names."""
    if stream.read(8) != _PNG_SIGNATURE:
        return
    while len(head := stream.read(8)) == 8:
        size, kind = int.from_bytes(head[:4], "big"), head[4:]
        if size > _LARGEST_CHUNK:
            return
        if kind not in wanted or size > _LARGEST_PACKET:
            yield kind, None
            stream.seek(size + 4, os.SEEK_CUR)
            continue
        content = stream.read(size)
        is_whole = stream.read(4) == zlib.crc32(kind + content).to_bytes(4, "big")
        yield kind, content if is_whole else None


def png_gamma(path: str | os.PathLike[str]) -> float | None:
    """Return the exponent that decodes a PNG file's colours to light; None if none is stated.

    OpenImageIO rounds it to one decimal place.

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
            if stated is None and len(content or b"") == 4 and 0 < value <= _LARGEST_CHUNK:
                stated = _GAMMA_SCALE / value
    return stated


def tiff_field(stream: BinaryIO, tag: int, part: int = 0) -> NDArray[Any] | None:
    """Return the numbers of a field of a TIFF directory; None: it is missing or damaged."""
    try:
        return _tiff_field(stream, tag, part)
    except (struct.error, KeyError, OverflowError, ValueError):
        return None


def _tiff_field(stream: BinaryIO, tag: int, part: int) -> NDArray[Any] | None:
    def numbers(form: str) -> tuple[int, ...]:
        return struct.unpack(order + form, stream.read(struct.calcsize(order + form)))

    stream.seek(0)
    order = {b"II": "<", b"MM": ">"}[stream.read(2)]
    (version,) = numbers("H")
    # BigTIFF has 8 bytes where TIFF has 4.
    count_form, offset_form = ("Q", "Q") if version == 43 else ("H", "I")
    if version == 43:
        stream.seek(8)
    size = struct.calcsize(offset_form)
    for remaining in range(part, -1, -1):
        (start,) = numbers(offset_form)
        stream.seek(start)
        (count,) = numbers(count_form)
        if remaining or not start:
            stream.seek(count * (4 + 2 * size), os.SEEK_CUR)
    for _ in range(count):
        field_tag, kind, length = numbers("HH" + offset_form)
        value = stream.read(size)
        if field_tag != tag:
            continue
        dtype = np.dtype(order + _TIFF_TYPES[kind])
        if length * dtype.itemsize > size:
            stream.seek(struct.unpack(order + offset_form, value)[0])
            value = stream.read(min(length * dtype.itemsize, _LARGEST_PACKET))
        return np.frombuffer(value, dtype, length)
    return None


def _of_tiff(stream: BinaryIO) -> int | None:
    """Return the orientation of Exif, which is a TIFF stream, or that of XMP in it."""
    numbers = tiff_field(stream, _ORIENTATION)
    if numbers is not None and numbers.size:
        return int(numbers[0])
    packet = tiff_field(stream, _XMP)
    return None if packet is None else _of_xmp(packet.tobytes())


def _of_xmp(packet: bytes) -> int | None:
    match = _IN_XMP.search(packet)
    return None if match is None else int(match[1])


def _of_png(stream: BinaryIO) -> int | None:
    """Exif and text may follow the pixels (PNG, third edition, 5.6)."""
    by_xmp = None
    for kind, content in png_chunks(stream, (b"eXIf", b"iTXt")):
        if kind == b"eXIf" and content is not None:
            if (orientation := _of_tiff(BytesIO(content))) is not None:
                return orientation
        elif content is not None and content.startswith(_XMP_OF_PNG):
            is_packed, rest = content[len(_XMP_OF_PNG)], content[len(_XMP_OF_PNG) + 2 :]
            text = rest.split(b"\0", 2)[-1]
            if is_packed:
                try:
                    text = zlib.decompressobj().decompress(text, _LARGEST_PACKET)
                except zlib.error:
                    continue
            by_xmp = by_xmp or _of_xmp(text)
    return by_xmp


def is_heif(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is AVIF or HEIF."""
    with open(path, "rb") as stream:
        head = stream.read(12)
    return head[4:8] == b"ftyp" and head[8:] in _HEIF_BRANDS


def _of_jpeg(stream: BinaryIO) -> int | None:
    stream.read(2)
    while len(head := stream.read(4)) == 4 and head[0] == 0xFF and head[1] != 0xDA:
        content = stream.read(max(int.from_bytes(head[2:], "big") - 2, 0))
        if head[1] == 0xE1 and content.startswith(_XMP_OF_JPEG):
            return _of_xmp(content)
    return None


def _of_webp(stream: BinaryIO) -> int | None:
    stream.read(12)
    while len(head := stream.read(8)) == 8:
        size = int.from_bytes(head[4:], "little")
        if head[:4] == b"XMP ":
            return _of_xmp(stream.read(min(size, _LARGEST_PACKET)))
        stream.seek(size + size % 2, os.SEEK_CUR)
    return None


def _of_radiance(stream: BinaryIO) -> int | None:
    match = _RESOLUTION.search(stream.read(1 << 16))
    axes = b"" if match is None else match[1] + match[2]
    return _RADIANCE.index(axes) + 1 if axes in _RADIANCE else None


_FINDERS: Final[Mapping[str, Callable[[BinaryIO], int | None]]] = {
    "hdr": _of_radiance,
    "jpeg": _of_jpeg,
    "png": _of_png,
    "tiff": _of_tiff,
    "webp": _of_webp,
}
