"""Facts of WebP files: orientation and Exif's colours."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, Final

from vkbloom._io.formats.facts import Facts
from vkbloom._io.formats.jpeg import EXIF
from vkbloom._io.formats.tiff import MAX_PACKET, exif_colours, orientation_of_xmp

if TYPE_CHECKING:
    import OpenImageIO

_EXIF, _XMP = b"EXIF", b"XMP "
# Of files, the name, the size and the kind come before the chunks.
_HEADER: Final = 12


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return what Exif and XMP say."""
    chunks = _chunks(stream)
    exif = chunks.get(_EXIF, b"").removeprefix(EXIF)
    orientation = None
    if not isinstance(spec.getattribute("Orientation"), int) and _XMP in chunks:
        orientation = orientation_of_xmp(chunks[_XMP])
    return Facts(
        orientation=orientation, colours=exif_colours(BytesIO(exif), spec) if exif else None
    )


def _chunks(stream: BinaryIO) -> dict[bytes, bytes]:
    """Return the first chunks of Exif and XMP."""
    found: dict[bytes, bytes] = {}
    stream.seek(_HEADER)
    while len(head := stream.read(8)) == 8:
        size = int.from_bytes(head[4:], "little")
        after = stream.tell() + size + size % 2
        if head[:4] in (_EXIF, _XMP) and head[:4] not in found:
            found[head[:4]] = stream.read(min(size, MAX_PACKET))
        stream.seek(after)
    return found
