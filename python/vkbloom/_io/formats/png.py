"""Facts of PNG files: orientation and colours, which chunks say."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, Final, NamedTuple

import numpy as np

from vkbloom._io.chromaticities import other_primaries
from vkbloom._io.formats.facts import Facts
from vkbloom._io.formats.tiff import (
    MAX_PACKET,
    exif_colours,
    first_orientation,
)
from vkbloom._io.picture import SPACES, StatedColours

if TYPE_CHECKING:
    import OpenImageIO

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
# The largest four-byte integer.
_MAX_INTEGER: Final = 2**31 - 1
# A gAMA chunk holds the exponent of the encoding times this number; 0 is no exponent. A cHRM chunk
# holds coordinates in the same unit.
_SCALE: Final = 100_000
_XMP: Final = b"XML:com.adobe.xmp\0"
_OF_COLOURS: Final = (b"gAMA", b"cHRM", b"sRGB")


class _Chunks(NamedTuple):
    """The chunks that say something; None: one is damaged.

    - `colours`: The first ones of colours, before the palette and the pixels.
    - `exif`, `texts`: They may follow the pixels (PNG, third edition, 5.6).
    """

    colours: dict[bytes, bytes]
    exif: list[bytes | None]
    texts: list[bytes]


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return what chunks say."""
    chunks = _read_chunks(stream)
    is_stated = isinstance(spec.getattribute("Orientation"), int)
    packets = [] if is_stated else [*map(_text_of, chunks.texts)]
    colours = _find_colours(chunks.colours)
    if colours is None:
        exif = chunks.exif[0] if chunks.exif else None
        srgb = StatedColours(SPACES["srgb"])
        colours = srgb if not exif else exif_colours(BytesIO(exif), spec, srgb)
    elif colours.gamma is not None:
        colours = colours._replace(space=spec.get_string_attribute("oiio:ColorSpace"))
    orientation = None if is_stated else first_orientation(chunks.exif, packets)
    return Facts(orientation=orientation, colours=colours)


def _read_chunks(stream: BinaryIO) -> _Chunks:
    found = _Chunks({}, [], [])
    is_before = True
    for kind, content in _chunks(stream, (*_OF_COLOURS, b"eXIf", b"iTXt")):
        is_before = is_before and kind not in (b"PLTE", b"IDAT")
        if kind == b"eXIf":
            found.exif.append(content)
        elif kind == b"iTXt" and content is not None and content.startswith(_XMP):
            found.texts.append(content[len(_XMP) :])
        elif kind in _OF_COLOURS and is_before and content is not None:
            found.colours.setdefault(kind, content)
    return found


def _chunks(stream: BinaryIO, wanted: tuple[bytes, ...]) -> Iterator[tuple[bytes, bytes | None]]:
    """Yield the name of each chunk, with the content of undamaged chunks of the wanted names."""
    if stream.read(8) != _SIGNATURE:
        return
    while len(head := stream.read(8)) == 8:
        size, kind = int.from_bytes(head[:4], "big"), head[4:]
        if size > _MAX_INTEGER:
            return
        if kind not in wanted or size > MAX_PACKET:
            yield kind, None
            stream.seek(size + 4, os.SEEK_CUR)
            continue
        content = stream.read(size)
        is_whole = stream.read(4) == zlib.crc32(kind + content).to_bytes(4, "big")
        yield kind, content if is_whole else None


def _text_of(content: bytes) -> bytes:
    """Return the text of a chunk with XMP, after its keyword; b"": it is damaged."""
    # Flags of the compression, the language and the translated keyword are before the text.
    text = content[2:].split(b"\0", 2)[-1]
    if not any(content[:1]):
        return text
    try:
        return zlib.decompressobj().decompress(text, MAX_PACKET)
    except zlib.error:
        return b""


def _find_colours(found: dict[bytes, bytes]) -> StatedColours | None:
    """Return what chunks say of colours; None: nothing.

    OpenImageIO rounds the exponent to one decimal place, and takes an exponent of 0, which PNG does
    not allow, as linear.

    An sRGB chunk has precedence over gAMA and cHRM chunks (PNG, third edition, 4.3). Chunks that
    are damaged, or that follow the palette or the pixels, are ignored. Primaries without an
    exponent are ignored, as browsers do.
    """
    if b"sRGB" in found:
        return StatedColours(SPACES["srgb"])
    value = int.from_bytes(found.get(b"gAMA", b""), "big")
    if len(found.get(b"gAMA", b"")) != 4 or not 0 < value <= _MAX_INTEGER:
        return None
    # White is first in the file.
    stored = np.frombuffer(found.get(b"cHRM", b"").ljust(32, b"\0")[:32], ">u4")
    numbers = (np.roll(stored, -2) / _SCALE).tolist()
    primaries = other_primaries(numbers) if b"cHRM" in found else None
    return StatedColours(gamma=_SCALE / value, primaries=primaries)
