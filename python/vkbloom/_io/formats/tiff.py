"""Facts of TIFF files (TIFF 6.0, BigTIFF), and of Exif and XMP, which other formats have, too."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Collection, Iterable, Iterator, Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.chromaticities import ADOBE, ADOBE_GAMMA, CHROMATICITIES, other_primaries
from vkbloom._io.formats.facts import Corrected, Facts
from vkbloom._io.picture import Alpha, StatedColours

if TYPE_CHECKING:
    import OpenImageIO

#: What to do with a camera's raw file.
RAW_ADVICE: Final = (
    "a camera's raw file; develop it first, for example with darktable or "
    "RawTherapee, and save it as TIFF or OpenEXR"
)

#: Spaces whose numbers are not those of red, green and blue.
LAB: Final = ("CIELAB", "ICCLAB")
#: Metadata in bytes: a damaged file may claim more.
MAX_PACKET: Final = 1 << 24
# Directories and fields of one directory. Readers of TIFF know a few hundred tags.
_MAX_DIRECTORIES: Final = 100
_MAX_FIELDS: Final = 4096
# The field types that are read: bytes, text, SHORT, LONG, RATIONAL, FLOAT, DOUBLE, undefined bytes,
# IFD, and those of 8 bytes of BigTIFF.
_TYPES: Final[Mapping[int, str]] = {
    **dict.fromkeys((1, 2, 7), "u1"),
    3: "u2",
    **dict.fromkeys((4, 5, 13), "u4"),
    11: "f4",
    12: "f8",
    **dict.fromkeys((16, 18), "u8"),
}
# A fraction has two numbers.
_RATIONAL: Final = 5
_ORDERS: Final[Mapping[bytes, Literal["<", ">"]]] = {b"II": "<", b"MM": ">"}
_NONE: Final = np.empty(0, np.uint8)
_DAMAGE: Final = (struct.error, KeyError, OverflowError, ValueError, OSError)

_NEW_SUBFILE_TYPE: Final = 254
_SUBFILE_TYPE: Final = 255
_PHOTOMETRIC: Final = 262
_SUB_DIRECTORIES: Final = 330
_DNG_VERSION: Final = 50706
# PhotometricInterpretation of TIFF/EP and DNG: a mosaic of colour filters, and linear raw.
_RAW: Final = (32803, 34892)
# How other raw files begin, with the position: CR2 (at its first directory's place), RAF, ORF, RW2,
# CR3, X3F and MRW.
_RAW_SIGNATURES: Final = (
    (4, b"\x10\0\0\0CR\x02"),
    (0, b"FUJIFILMCCD-RAW"),
    (0, b"IIRO"),
    (0, b"IIRS"),
    (0, b"MMOR"),
    (0, b"IIU\0"),
    (4, b"ftypcrx "),
    (0, b"FOVb"),
    (0, b"\0MRM"),
)
# ExtraSamples of TIFF 6.0, and its value for colours that are multiplied by alpha.
_EXTRA_SAMPLES: Final = 338
_ASSOCIATED: Final = 1
# PhotometricInterpretation for grey: 0 is white, 0 is black. And the compressions of JPEG, which
# libtiff inverts itself.
_GREY: Final = (0, 1)
_WHITE_IS_0: Final = 0
_JPEG: Final = (6, 7)
_ORIENTATION: Final = 274
_XMP: Final = 700
# Of an attribute or an element (XMP specification part 1, 7).
_IN_XMP: Final = re.compile(rb"tiff:Orientation\s*(?:=\s*[\"']|>)\s*([1-8])\b")
# Tags of TIFF and Exif: directories, and what they say of colours.
_EXIF, _INTEROPERABILITY = 34665, 40965
_WHITE, _PRIMARIES = 318, 319
_COLOUR_SPACE, _GAMMA = 40961, 42240
_INDEX: Final = 1
# Exif's colour space: sRGB, uncalibrated, and some cameras' number of Adobe RGB.
_SRGB, _UNCALIBRATED, _ADOBE_RGB = 1, 65535, 2
# What DCF 2.0 calls its option file, which has Adobe RGB.
_OPTION_FILE: Final = b"R03"


class Directories:
    """The directories of a TIFF stream. Damage raises one of the errors of `_DAMAGE`."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        stream.seek(0)
        self._order: Literal["<", ">"] = _ORDERS[stream.read(2)]
        (version,) = self._numbers("H")
        # BigTIFF has 8 bytes where TIFF has 4.
        self._count_form, self._offset_form = ("Q", "Q") if version == 43 else ("H", "I")
        if version == 43:
            stream.seek(8)
        #: Position of the first directory.
        (self.first,) = self._numbers(self._offset_form)

    def _numbers(self, form: str) -> tuple[int, ...]:
        form = self._order + form
        return struct.unpack(form, self._stream.read(struct.calcsize(form)))

    def read(self, start: int, tags: Collection[int]) -> tuple[dict[int, NDArray[Any]], int]:
        """Return the undamaged fields of these tags, and the position of the next directory."""
        if not start:
            raise ValueError("there is no such directory")
        self._stream.seek(start)
        (count,) = self._numbers(self._count_form)
        entries = [self._entry() for _ in range(min(count, _MAX_FIELDS))]
        try:
            (following,) = self._numbers(self._offset_form)
        except struct.error:
            # Exif may end here.
            following = 0
        fields: dict[int, NDArray[Any]] = {}
        for tag, kind, length, value in entries:
            if tag in tags and (numbers := self._value(kind, length, value)) is not None:
                fields.setdefault(tag, numbers)
        return fields, following if count <= _MAX_FIELDS else 0

    def _entry(self) -> tuple[int, int, int, bytes]:
        tag, kind, length = self._numbers("HH" + self._offset_form)
        size = struct.calcsize(self._offset_form)
        value = self._stream.read(size)
        if len(value) < size:
            raise struct.error("the directory ends early")
        return tag, kind, length, value

    def _value(self, kind: int, length: int, value: bytes) -> NDArray[Any] | None:
        """Return the numbers of a field, two of each fraction; None: it is damaged."""
        length *= 2 if kind == _RATIONAL else 1
        try:
            dtype = np.dtype(_TYPES[kind]).newbyteorder(self._order)
            if length * dtype.itemsize > len(value):
                self._stream.seek(struct.unpack(self._order + self._offset_form, value)[0])
                value = self._stream.read(min(length * dtype.itemsize, MAX_PACKET))
            return np.frombuffer(value, dtype, length)
        except _DAMAGE:
            return None

    def all(self, tags: Collection[int]) -> Iterator[dict[int, NDArray[Any]]]:
        """Yield the fields of each directory, those of subdirectories after their own directory."""
        pending, known = [self.first], set[int]()
        while pending and len(known) < _MAX_DIRECTORIES:
            start = pending.pop()
            if start in known or not start:
                continue
            known.add(start)
            fields, following = self.read(start, (*tags, _SUB_DIRECTORIES))
            yield fields
            below = _integers(fields, _SUB_DIRECTORIES)
            pending += [following, *map(int, below[:_MAX_DIRECTORIES][::-1])]


def _integers(fields: Mapping[int, NDArray[Any]], tag: int) -> NDArray[Any]:
    """Return the numbers of a field; none if it is missing or has others than integers."""
    value = fields.get(tag, _NONE)
    return value if value.dtype.kind == "u" else _NONE


def tiff_field(stream: BinaryIO, tag: int, part: int = 0) -> NDArray[Any] | None:
    """Return the integers of a field of a TIFF directory; None: it is missing or damaged."""
    try:
        directories = Directories(stream)
        start = directories.first
        for _ in range(part):
            _, start = directories.read(start, ())
        fields, _ = directories.read(start, (tag,))
    except _DAMAGE:
        return None
    value = _integers(fields, tag)
    return value if tag in fields and value.size == fields[tag].size else None


def full_picture(path: str) -> tuple[int, str | None]:
    """Return the number of the first part that is no reduced picture, and a note about it.

    Raises ValueError for a camera's raw file, whose preview OpenImageIO takes for the picture.
    """
    if is_raw(path):
        raise ValueError(f"{path}: is {RAW_ADVICE}")
    reduced = reduced_parts(path)
    if not any(reduced[:1]):
        return 0, None
    if all(reduced):
        return 0, "the picture is a reduced one, as the file says; the full one cannot be read"
    part = reduced.index(False)
    return part, f"part 0 is a reduced picture, as the file says; read part {part}"


def is_raw(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a camera's raw file, whatever its previews are."""
    with open(path, "rb") as stream:
        head = stream.read(32)
        if any(head.startswith(word, at) for at, word in _RAW_SIGNATURES):
            return True
        try:
            for fields in Directories(stream).all((_PHOTOMETRIC, _DNG_VERSION)):
                photometric = _integers(fields, _PHOTOMETRIC)
                if _DNG_VERSION in fields or np.isin(photometric, _RAW).any():
                    return True
        except _DAMAGE:
            pass
    return False


def reduced_parts(path: str | os.PathLike[str]) -> list[bool]:
    """Return for each of a file's first directories whether it is a reduced picture."""
    reduced: list[bool] = []
    with open(path, "rb") as stream:
        try:
            directories = Directories(stream)
            start = directories.first
            while start and len(reduced) < _MAX_DIRECTORIES:
                fields, start = directories.read(start, (_NEW_SUBFILE_TYPE, _SUBFILE_TYPE))
                new = _integers(fields, _NEW_SUBFILE_TYPE)[:1] & 1
                # The old field has 2 for a reduced picture.
                old = _integers(fields, _SUBFILE_TYPE)[:1] == 2
                reduced.append(bool(new.any() or old.any()))
        except _DAMAGE:
            pass
    return reduced


def exif_fields(stream: BinaryIO, *tags: int, pointers: tuple[int, ...] = ()) -> dict[int, Any]:
    """Return fields of the directory to which a chain of pointers leads from the first one.

    Fields that are missing, empty or damaged are left out.
    """
    try:
        directories = Directories(stream)
        start = directories.first
        for pointer in pointers:
            fields, _ = directories.read(start, (pointer,))
            start = int(fields[pointer][0])
        fields, _ = directories.read(start, tags)
    except (*_DAMAGE, IndexError):
        return {}
    return {tag: value for tag, value in fields.items() if value.size}


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return what the fields of a part say."""
    extra = tiff_field(stream, _EXTRA_SAMPLES, part)
    is_multiplied = extra is not None and [*extra[extra != 0][:1]] == [_ASSOCIATED]
    orientation = None
    if not isinstance(spec.getattribute("Orientation"), int):
        orientation = orientation_of_exif(stream)
    photometric = spec.get_int_attribute("tiff:PhotometricInterpretation", 2)
    channels = None
    if photometric in _GREY:
        # OpenImageIO calls further samples green and blue.
        more = range(1, spec.nchannels)
        alpha = spec.alpha_channel
        channels = ("Y", *("A" if index == alpha else f"channel{index}" for index in more))
    is_inverted_jpeg = (
        str(spec.format) == "uint8" and spec.get_int_attribute("tiff:Compression") in _JPEG
    )
    is_wrong = photometric == _WHITE_IS_0 and not is_inverted_jpeg
    return Facts(
        channels=channels,
        orientation=orientation,
        alpha=Alpha.MULTIPLIED if is_multiplied else Alpha.STRAIGHT,
        colours=exif_colours(stream, spec),
        correct=_with_black_0 if is_wrong else None,
    )


def _with_black_0(pixels: NDArray[Any]) -> Corrected:
    """Return grey whose 0 is black; other channels as they are stored."""
    is_float = pixels.dtype.kind == "f"
    unit = pixels.dtype.type(1 if is_float else np.iinfo(pixels.dtype).max)
    made = pixels.copy()
    wrong = slice(1, None) if pixels.dtype == np.uint8 else slice(0, 1)
    made[:, :, wrong] = unit - made[:, :, wrong]
    # TIFF 6.0 defines it for integers.
    said = "the file says that 0 is white; its floats are taken as 1 minus the light"
    return Corrected(made, (said,) if is_float else ())


def orientation_of_exif(stream: BinaryIO) -> int | None:
    """Return the orientation of Exif, which is a TIFF stream, or that of XMP in it."""
    numbers = tiff_field(stream, _ORIENTATION)
    if numbers is not None and numbers.size:
        return int(numbers[0])
    packet = tiff_field(stream, _XMP)
    return None if packet is None else orientation_of_xmp(packet.tobytes())


def first_orientation(exif: Iterable[bytes | None], packets: Iterable[bytes]) -> int | None:
    """Return the first orientation of some Exif, else of some XMP; None is damaged Exif."""
    for content in exif:
        if content is not None and (found := orientation_of_exif(BytesIO(content))) is not None:
            return found
    for packet in packets:
        if (found := orientation_of_xmp(packet)) is not None:
            return found
    return None


def orientation_of_xmp(packet: bytes) -> int | None:
    """Return the orientation that an XMP packet has."""
    match = _IN_XMP.search(packet)
    return None if match is None else int(match[1])


def exif_colours(
    exif: BinaryIO, spec: OpenImageIO.ImageSpec, stated: StatedColours | None = None
) -> StatedColours:
    """Return what Exif, a TIFF stream, says of colours.

    `stated`: What the file says otherwise; by default what OpenImageIO says.
    """
    if stated is None:
        space = spec.get_string_attribute("oiio:ColorSpace")
        stated = StatedColours(space, spec.get_float_attribute("oiio:Gamma", 0.0) or None)
    found = exif_fields(exif, _COLOUR_SPACE, _GAMMA, pointers=(_EXIF,))
    number = found[_COLOUR_SPACE][0] if _COLOUR_SPACE in found else _UNCALIBRATED
    if number == _SRGB:
        return stated
    index = exif_fields(exif, _INDEX, pointers=(_EXIF, _INTEROPERABILITY)).get(_INDEX)
    if number == _ADOBE_RGB or (index is not None and index.tobytes()[:3] == _OPTION_FILE):
        return stated._replace(gamma=ADOBE_GAMMA, primaries=ADOBE)
    fields = exif_fields(exif, _WHITE, _PRIMARIES)
    primaries, white = _numbers(fields, _PRIMARIES, 6), _numbers(fields, _WHITE, 2)
    if not primaries:
        return stated
    others = other_primaries([*primaries, *(white or CHROMATICITIES["rec709"][6:])])
    if others is None:
        return stated
    gamma = (*_numbers(found, _GAMMA, 1), None)[0]
    return stated._replace(
        gamma=gamma if gamma is not None and gamma > 0 else None, primaries=others
    )


def _numbers(fields: Mapping[int, NDArray[Any]], tag: int, count: int) -> list[float]:
    """Return a field's numbers; []: it has others than expected."""
    values = fields.get(tag, np.empty(0))
    if values.size == 2 * count and values[1::2].all():
        # Fractions.
        values = values[::2] / values[1::2]
    return [float(value) for value in values] if values.size == count else []
