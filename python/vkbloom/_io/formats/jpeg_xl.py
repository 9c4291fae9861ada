"""Facts of JPEG XL files (ISO/IEC 18181), of their header."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO, Final, NamedTuple

from numpy.typing import NDArray

from vkbloom._io.formats.facts import Corrected, Facts
from vkbloom._io.picture import Alpha, StatedColours

if TYPE_CHECKING:
    import OpenImageIO

# A codestream or a container (ISO/IEC 18181-2).
_CODESTREAM: Final = b"\xff\x0a"
_CONTAINER: Final = b"\0\0\0\x0cJXL \r\n\x87\n"
#: How files begin.
SIGNATURES: Final = (_CODESTREAM, _CONTAINER)
# OpenImageIO needs this many bytes of a file.
_MIN_BYTES: Final = 128
# Bytes of a codestream that are looked at: enough for some channels with names.
_MAX_HEADER: Final = 1 << 13
_MAX_BOXES: Final = 1000
_ALPHA, _SPOT, _MOSAIC = 0, 2, 5
# Each choice of a number: the bits that follow, and what is added to them.
_Choices = tuple[tuple[int, int], ...]
_SIZE: Final[_Choices] = ((9, 1), (13, 1), (18, 1), (30, 1))
_PREVIEW_EIGHTHS: Final[_Choices] = ((0, 16), (0, 32), (5, 1), (9, 33))
_PREVIEW: Final[_Choices] = ((6, 1), (8, 65), (10, 321), (12, 1345))
_ANIMATION: Final[tuple[_Choices, ...]] = (
    ((0, 100), (0, 1000), (10, 1), (30, 1)),
    ((0, 1), (0, 1001), (8, 1), (10, 1)),
    ((0, 0), (3, 0), (16, 0), (32, 0)),
)
_BITS: Final[_Choices] = ((0, 8), (0, 10), (0, 12), (6, 1))
_FLOAT_BITS: Final[_Choices] = ((0, 32), (0, 16), (0, 24), (6, 1))
_CHANNELS: Final[_Choices] = ((0, 0), (0, 1), (4, 2), (12, 1))
_ENUM: Final[_Choices] = ((0, 0), (0, 1), (4, 2), (6, 18))
_SHIFT: Final[_Choices] = ((0, 0), (0, 3), (0, 4), (3, 1))
_NAME: Final[_Choices] = ((0, 0), (4, 0), (5, 16), (10, 48))
_MOSAIC_CHANNEL: Final[_Choices] = ((0, 1), (2, 0), (4, 3), (8, 19))


class SizeHeader(NamedTuple):
    """What the header says.

    - `is_multiplied`: Whether colours are multiplied by alpha.
    - `is_xyb`: Whether colours are stored as XYB, as they are in lossy files.
    - `has_profile`: Whether the file has an ICC profile.
    - `bits`: Bits of a colour.
    - `bits_at`: Position in bits of what says so in the file. None: floats.
    """

    is_multiplied: bool = False
    is_xyb: bool = True
    has_profile: bool = False
    bits: int = 8
    bits_at: int | None = None

    @property
    def has_coarse_light(self) -> bool:
        """Whether libjxl gives linear light of 8 bits: it does not apply profiles to XYB."""
        return self.is_xyb and self.has_profile and self.bits <= 8 and self.bits_at is not None


class _Bits:
    """The bits of a codestream, the lowest of each byte first. EOFError: there are no more."""

    def __init__(self, content: bytes) -> None:
        self._value = int.from_bytes(content, "little")
        self._size = 8 * len(content)
        self.at = 0

    def take(self, count: int) -> int:
        if self.at + count > self._size:
            raise EOFError
        value = self._value >> self.at & ((1 << count) - 1)
        self.at += count
        return value

    def number(self, choices: _Choices) -> int:
        count, more = choices[self.take(2)]
        return self.take(count) + more


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return what the header says. Floats are on the curve that the file states."""
    header = read_header(stream)
    colours = StatedColours(
        space=spec.get_string_attribute("oiio:ColorSpace"),
        gamma=spec.get_float_attribute("oiio:Gamma", 0.0) or None,
        is_encoded=True,
    )
    return Facts(
        alpha=Alpha.MULTIPLIED if header.is_multiplied else Alpha.STRAIGHT,
        colours=colours,
        correct=_with_note if header.has_coarse_light else None,
    )


def _with_note(pixels: NDArray[Any]) -> Corrected:
    said = (
        "its colours are stored in another space than that of its ICC profile, and are decoded "
        "to linear Rec. 709; colours outside of it are clipped"
    )
    return Corrected(pixels, (said,))


def read_header(stream: BinaryIO) -> SizeHeader:
    """Return what the header of a file says; a header that is cut off says nothing."""
    start = _codestream_at(stream)
    if start is None:
        return SizeHeader()
    stream.seek(start)
    content = stream.read(_MAX_HEADER)
    try:
        return _header(_Bits(content[2:]), 8 * (start + 2))
    except EOFError:
        return SizeHeader()


def _codestream_at(stream: BinaryIO) -> int | None:
    """Return the position of the codestream in a file."""
    at = stream.seek(0)
    head = stream.read(len(_CONTAINER))
    if not head.startswith(_CODESTREAM) and head != _CONTAINER:
        return None
    for _ in range(_MAX_BOXES):
        stream.seek(at)
        head = stream.read(22)
        # A box that is divided has a number first.
        after = {b"jxlc": 0, b"jxlp": 4}.get(head[4:8], 0)
        begin = 16 if head[:4] == b"\0\0\0\1" else 8
        if head.startswith(_CODESTREAM):
            return at
        if head[4:8] in (b"jxlc", b"jxlp"):
            found = head[begin + after :].startswith(_CODESTREAM)
            return at + begin + after if found else None
        size = int.from_bytes(head[8:16] if begin == 16 else head[:4], "big")
        if size < begin or at + size > 1 << 62:
            return None
        at += size
    return None


def _header(bits: _Bits, start: int) -> SizeHeader:
    """Return the header; `start`: position in bits of its first bit in the file."""
    _skip_size(bits)
    if bits.take(1):
        # All values are the default ones.
        return SizeHeader()
    if bits.take(1):
        bits.take(3)
        if bits.take(1):
            _skip_size(bits)
        if bits.take(1):
            _skip_size(bits, is_preview=True)
        if bits.take(1):
            for choices in _ANIMATION:
                bits.number(choices)
            bits.take(1)
    at = bits.at
    depth, is_float = _depth(bits)
    bits.take(1)
    alphas = [_is_multiplied_alpha(bits) for _ in range(bits.number(_CHANNELS))]
    is_xyb = bool(bits.take(1))
    has_profile = bool(not bits.take(1) and bits.take(1))
    return SizeHeader(
        is_multiplied=next((alpha for alpha in alphas if alpha is not None), False),
        is_xyb=is_xyb,
        has_profile=has_profile,
        bits=depth,
        bits_at=None if is_float else start + at + 1,
    )


def _skip_size(bits: _Bits, *, is_preview: bool = False) -> None:
    is_in_eighths = bits.take(1)

    def side() -> None:
        if is_preview:
            bits.number(_PREVIEW_EIGHTHS if is_in_eighths else _PREVIEW)
        elif is_in_eighths:
            bits.take(5)
        else:
            bits.number(_SIZE)

    side()
    if not bits.take(3):
        # There is no ratio of width to height.
        side()


def _depth(bits: _Bits) -> tuple[int, bool]:
    """Return the bits of a number, and whether it is a float."""
    if not bits.take(1):
        return bits.number(_BITS), False
    count = bits.number(_FLOAT_BITS)
    bits.take(4)
    return count, True


def _is_multiplied_alpha(bits: _Bits) -> bool | None:
    """Read a further channel; return what its alpha is, None for other channels."""
    if bits.take(1):
        return False
    kind = bits.number(_ENUM)
    _depth(bits)
    bits.number(_SHIFT)
    bits.take(8 * bits.number(_NAME))
    if kind == _ALPHA:
        return bool(bits.take(1))
    if kind == _SPOT:
        bits.take(4 * 16)
    elif kind == _MOSAIC:
        bits.number(_MOSAIC_CHANNEL)
    return None


def readable_content(path: str) -> bytes | None:
    """Return what OpenImageIO can read instead of a file; None: the file itself.

    OpenImageIO needs 128 bytes of JPEG XL. Where it would get linear light of 8 bits, in which dark
    colours have steps, the content says 16 bits: libjxl computes floats and rounds them to what the
    header says.
    """
    with open(path, "rb") as stream:
        header = read_header(stream)
        stream.seek(0)
        head = stream.read(_MIN_BYTES)
        is_short = len(head) < _MIN_BYTES and head.startswith(SIGNATURES)
        if not is_short and not header.has_coarse_light:
            return None
        content = head + stream.read()
    return _of_16_bits(content, header).ljust(_MIN_BYTES, b"\0")


def _of_16_bits(content: bytes, header: SizeHeader) -> bytes:
    """Return a file whose header says 12 or 16 bits, if it would give coarse light."""
    if not header.has_coarse_light or header.bits_at is None:
        return content
    byte, shift = divmod(header.bits_at, 8)
    word = int.from_bytes(content[byte : byte + 2], "little")
    # Two bits choose 8, 10, 12 or a number, of six bits, to which 1 is added.
    choice = word >> shift & 3
    if choice == 3:
        word |= 15 << shift + 2
    else:
        word = word & ~(3 << shift) | 2 << shift
    return content[:byte] + word.to_bytes(2, "little") + content[byte + 2 :]
