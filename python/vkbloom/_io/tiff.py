"""Read fields of TIFF directories (TIFF 6.0, BigTIFF), which Exif has, too."""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterator, Mapping
from typing import Any, BinaryIO, Final, Literal

import numpy as np
from numpy.typing import NDArray

#: What to do with a camera's raw file.
RAW_ADVICE: Final = (
    "a camera's raw file; develop it first, for example with darktable or "
    "RawTherapee, and save it as TIFF or OpenEXR"
)

# Values in bytes: a damaged file may claim more.
_MAX_BYTES: Final = 1 << 24
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
                value = self._stream.read(min(length * dtype.itemsize, _MAX_BYTES))
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
