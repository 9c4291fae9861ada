"""Find what OpenImageIO's readers leave out of image files: chunks, fields and packets."""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from typing import Any, BinaryIO, Final

from numpy.typing import NDArray

from vkbloom._formats import MAX_FLOAT
from vkbloom._io.tiff import tiff_field

#: What to do with AVIF and HEIF.
HEIF_ADVICE: Final = (
    "this OpenImageIO is built without libheif, which reads AVIF and HEIF; convert the file to "
    "PNG, HEIF by pillow-heif"
)
# Brands of ISO base media files: of ISO/IEC 23008-12 and of AVIF.
_HEIF_BRANDS: Final = b"avif avis heic heix hevc heim heis hevx mif1 msf1".split()

_PNG_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
# The largest four-byte integer of PNG.
_LARGEST_CHUNK: Final = 2**31 - 1
# Metadata in bytes: a damaged file may claim more.
_LARGEST_PACKET: Final = 1 << 24
# A FITS file consists of blocks of lines, and its images begin with one of these (FITS 4.0, 4.4.1).
_FITS_BLOCK, _FITS_CARD = 2880, 80
_FITS_IMAGES: Final = (b"SIMPLE", b"XTENSION= 'IMAGE   '")
_FITS_SCALE: Final = re.compile(
    rb"(BSCALE  |BZERO   )= *([-+]?(?:\d+\.?\d*|\.\d+)(?:[ED][-+]?\d+)?) *(?:/|\Z)", re.IGNORECASE
)
_ORIENTATION: Final = 274
_XMP: Final = 700
_EXIF_OF_JPEG: Final = b"Exif\0\0"
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


def fits_scale(path: str | os.PathLike[str], part: int) -> tuple[float, float]:
    """Return BSCALE and BZERO of a part of a FITS file, 1 and 0 if it has none."""
    found: dict[bytes, float] = {}
    index = -1
    with open(path, "rb") as stream:
        while len(block := stream.read(_FITS_BLOCK)) == _FITS_BLOCK:
            index += block.startswith(_FITS_IMAGES)
            if index != part:
                continue
            cards = [block[at : at + _FITS_CARD] for at in range(0, _FITS_BLOCK, _FITS_CARD)]
            for match in filter(None, map(_FITS_SCALE.match, cards)):
                value = float(match[2].upper().replace(b"D", b"E"))
                if abs(value) <= MAX_FLOAT:
                    found.setdefault(match[1].upper().strip(), value)
            if any(card.startswith(b"END ") for card in cards):
                break
    return found.get(b"BSCALE", 1.0), found.get(b"BZERO", 0.0)


def is_heif(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is AVIF or HEIF."""
    with open(path, "rb") as stream:
        head = stream.read(12)
    return head[4:8] == b"ftyp" and head[8:] in _HEIF_BRANDS


def _jpeg_segments(stream: BinaryIO, marker: int) -> Iterator[bytes]:
    """Yield the segments of a marker before the pixels of a JPEG file."""
    stream.read(2)
    while len(head := stream.read(4)) == 4 and head[0] == 0xFF and head[1] != 0xDA:
        content = stream.read(max(int.from_bytes(head[2:], "big") - 2, 0))
        if head[1] == marker:
            yield content


def _of_jpeg(stream: BinaryIO) -> int | None:
    for content in _jpeg_segments(stream, 0xE1):
        if content.startswith(_XMP_OF_JPEG):
            return _of_xmp(content)
    return None


def _webp_chunk(stream: BinaryIO, wanted: bytes) -> bytes | None:
    stream.read(12)
    while len(head := stream.read(8)) == 8:
        size = int.from_bytes(head[4:], "little")
        if head[:4] == wanted:
            return stream.read(min(size, _LARGEST_PACKET))
        stream.seek(size + size % 2, os.SEEK_CUR)
    return None


def _of_webp(stream: BinaryIO) -> int | None:
    packet = _webp_chunk(stream, b"XMP ")
    return None if packet is None else _of_xmp(packet)


def exif_of(stream: BinaryIO, kind: str) -> BinaryIO | None:
    """Return the Exif of a JPEG, PNG, TIFF or WebP file, a TIFF stream; None: there is none."""
    content = None
    match kind:
        case "tiff":
            return stream
        case "jpeg":
            exif = filter(lambda one: one.startswith(_EXIF_OF_JPEG), _jpeg_segments(stream, 0xE1))
            content = next(exif, b"")[len(_EXIF_OF_JPEG) :]
        case "png":
            chunks = png_chunks(stream, (b"eXIf",))
            content = next((content for name, content in chunks if name == b"eXIf"), None)
        case "webp":
            # Some programs write the signature of JPEG.
            content = (_webp_chunk(stream, b"EXIF") or b"").removeprefix(_EXIF_OF_JPEG)
    return BytesIO(content) if content else None


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
