"""Facts of JPEG files: orientation, Exif's colours, no alpha."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, Final

from vkbloom._io.formats.facts import Facts
from vkbloom._io.formats.tiff import exif_colours, orientation_of_xmp
from vkbloom._io.picture import Alpha

if TYPE_CHECKING:
    import OpenImageIO

_APP1: Final = 0xE1
_SCAN: Final = 0xDA
#: What Exif begins with. Some programs write it into WebP files, too.
EXIF: Final = b"Exif\0\0"
_XMP: Final = b"http://ns.adobe.com/xap/1.0/\0"


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return what Exif and XMP say. The alpha of Ultra HDR is 1."""
    segments = [*_segments(stream)]
    exif = next((one for one in segments if one.startswith(EXIF)), b"")[len(EXIF) :]
    orientation = None
    if not isinstance(spec.getattribute("Orientation"), int):
        packet = next((one for one in segments if one.startswith(_XMP)), None)
        orientation = None if packet is None else orientation_of_xmp(packet)
    colours = exif_colours(BytesIO(exif), spec) if exif else None
    return Facts(orientation=orientation, alpha=Alpha.NONE, colours=colours)


def _segments(stream: BinaryIO) -> Iterator[bytes]:
    """Yield the segments APP1 before the pixels."""
    stream.read(2)
    while len(head := stream.read(4)) == 4 and head[0] == 0xFF and head[1] != _SCAN:
        content = stream.read(max(int.from_bytes(head[2:], "big") - 2, 0))
        if head[1] == _APP1:
            yield content
