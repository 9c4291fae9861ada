"""Images of files, as stored and as decoded for a renderer.

Bloom is computed on linear values: images are decoded before, and encoded after it if the file has
integers.

==================== ========================= =====================================
numbers in the file  taken as                  written as
==================== ========================= =====================================
8 or 16 bit integers what the file says (ICC   sRGB
                     profile, gamma, cICP,
                     Exif), else sRGB
half, float          linear (but JPEG XL: what linear
                     the file says)
==================== ========================= =====================================
"""

from __future__ import annotations

import enum
import os
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import native_order, plain_array
from vkbloom._c_paths import is_name
from vkbloom._formats import Curve

#: "linear", "srgb" or the name of a colour space of OpenColorIO.
Colour: TypeAlias = str
#: The colour encoding of a file to write.
SavedColour = Literal["linear", Curve]
#: x and y of red, green, blue and white.
Chromaticities: TypeAlias = tuple[float, ...]
#: x, y, width, height in pixels.
Window: TypeAlias = tuple[int, int, int, int]

# The dtype for reading each number type, by OpenImageIO's names.
DTYPES: Final[Mapping[str, np.dtype[Any]]] = {
    "uint8": np.dtype(np.uint8),
    "uint16": np.dtype(np.uint16),
    "half": np.dtype(np.float16),
    "float": np.dtype(np.float32),
    "double": np.dtype(np.float32),
}

# OpenImageIO's names of the number types to write, by dtype.
PIXEL_TYPES: Final[Mapping[str, str]] = {
    "uint8": "uint8",
    "uint16": "uint16",
    "float16": "half",
    "float32": "float",
}

#: Formats with a data window and a display window. Positions of others, such as DPX, move nothing.
WITH_WINDOWS: Final = ("openexr",)
# OpenImageIO's names of colour spaces.
SPACES: Final[Mapping[str, str]] = {
    "linear": "lin_rec709_scene",
    "srgb": "srgb_rec709_scene",
    "gamma22": "g22_rec709_scene",
}

# Attributes that are also valid for the result: those about colours and pixels, the size in print,
# and who took the picture where and how.
_KEPT_ATTRIBUTES: Final = frozenset(
    (
        *("chromaticities", "ICCProfile", "PixelAspectRatio"),
        *("XResolution", "YResolution", "ResolutionUnit", "jpeg:subsampling"),
        *("Artist", "Copyright", "DateTime", "ImageDescription", "Make", "Model", "Keywords"),
        *("ExposureTime", "FNumber"),
    )
)
_KEPT_GROUPS: Final = ("Exif:", "GPS:", "IPTC:")
# Of names in a message: how many, and characters of each.
_MAX_NAMES: Final = 20
_MAX_NAME: Final = 255
# libjpeg's warning about bytes after the pixels of a scan. Before a restart marker, 0xd0 to 0xd7,
# pixels were lost.
_EXTRA_BYTES: Final = re.compile(
    r"\AJPEG error: Corrupt JPEG data: (\d+) extraneous bytes before marker 0x(?!d[0-7])[^\n]*\Z"
)
# Attributes that a conversion or rotation makes wrong.
_LOST_ATTRIBUTES: Final = frozenset(
    ("Exif:ColorSpace", "Exif:Gamma", "Exif:PixelXDimension", "Exif:PixelYDimension")
)


class Highlights(enum.Enum):
    """What a file has of light above white: the one place that says what a photograph is."""

    #: Integers for SDR: everything brighter is clipped at 1, and can be expanded.
    CLIPPED = enum.auto()
    #: A photograph for SDR with a gain map, which gives values above 1.
    MAPPED = enum.auto()
    #: Floats, and integers on the curves PQ and HLG: values above 1 are stored.
    STORED = enum.auto()


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredImage:
    """An image as stored in a file: every channel, no value changed.

    - `pixels`: ndarray, shape (H, W, C); uint8, uint16, float16 or float32 (also for doubles), top
      row first, turned upright if the file has an orientation. They cover the data window and the
      display window; pixels without data are 0.
    - `channels`: The names of the C channels, such as ("R", "G", "B", "A"); "" for one without a
      meaning.
    - `numbers`: OpenImageIO's name of each channel's number type: "uint8", "uint16", "half",
      "float" or "double".
    - `origin`: Position of the first pixel in an OpenEXR file's coordinates, else (0, 0).
    - `display`: The display window (x, y, width, height), in the same coordinates.
    - `associated`: Whether colours are multiplied by alpha: encoded ones in files of integers.
    - `space`: OpenImageIO's name of the file's colour space; "" if the file has none.
    - `gamma`: The exponent that decodes colours to light, if the file states one. It is more exact
      than `space`, and has precedence unless there are `code_points`.
    - `attributes`: Those of which `is_kept` is true, by OpenImageIO's names.
    - `own`: Those that are only written from OpenEXR to OpenEXR (`exr_attributes.own_attributes`).
    - `parts`: The names of the file's parts (the first 100), of which the pixels are one; "" for a
      part without a name.
    - `profile_name`: The name in the ICC profile; "" without a profile.
    - `code_points`: Those of the file's colours (Rec. ITU-T H.273), as in a cICP chunk, which has
      precedence over a profile (PNG, third edition): primaries, curve, matrix, range. None: there
      are none, or they are not known.
    - `primaries`: The chromaticities that the file states without a profile, if they are others
      than those of Rec. 709. Colours are converted from them.
    - `is_ultra_hdr`: Whether floats were made of integers: light with the profile's primaries.
    - `is_encoded`: Whether floats are on the curve that the file states, as in JPEG XL.
    - `part`: The number of the part that was read.
    - `notes`: Notes for the user about how the file was read.
    """

    pixels: NDArray[Any]
    channels: tuple[str, ...]
    numbers: tuple[str, ...]
    origin: tuple[int, int]
    display: Window
    associated: bool
    space: str
    attributes: Mapping[str, tuple[Any, Any]]
    own: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    parts: tuple[str, ...] = ("",)
    profile_name: str = ""
    code_points: tuple[int, ...] | None = None
    gamma: float | None = None
    primaries: Chromaticities | None = None
    is_ultra_hdr: bool = False
    is_encoded: bool = False
    part: int = 0
    notes: tuple[str, ...] = ()

    @property
    def profile(self) -> bytes | None:
        """The file's ICC profile."""
        _, value = self.attributes.get("ICCProfile", (None, None))
        return None if value is None else np.asarray(value, np.uint8).tobytes()


@dataclass(frozen=True, eq=False, kw_only=True)
class Picture:
    """An image that `vkbloom.Renderer.apply` accepts, and the data to write it to a file.

    - `pixels`: ndarray, shape (H, W, 3) or (H, W, 4); uint8, float16 or float32; grey images have
      three equal colours.
    - `encoding`: Encoding of the colours. None: not known, because the values were not decoded.
    - `numbers`: OpenImageIO's name of the number type in the file.
    - `grey`: Whether the file has one colour channel instead of three.
    - `stored`: The image as stored in the file.
    - `notes`: Notes for the user about how the file was interpreted.
    - `colour`: The colour space from which colours were decoded: "linear", "srgb", the name of
      another space or of the file's profile; "" if the values were not decoded.
    - `hidden`, `visible`: The sum of straight colours where alpha is 0, and that of the others.
    - `highlights`: What the file has of light above white.
    """

    pixels: NDArray[Any]
    encoding: SavedColour | None
    numbers: str
    grey: bool
    stored: StoredImage
    notes: tuple[str, ...] = ()
    colour: str = ""
    hidden: float = 0.0
    visible: float = 0.0
    highlights: Highlights = Highlights.STORED

    @classmethod
    def of_values(
        cls,
        pixels: NDArray[Any],
        numbers: str = "uint8",
        encoding: SavedColour | None = None,
        attributes: Mapping[str, tuple[Any, Any]] | None = None,
    ) -> Self:
        """Make a picture from an array. Without an encoding, `save` writes its values unchanged."""
        height, width, channels = pixels.shape
        stored = StoredImage(
            pixels=pixels,
            channels=("R", "G", "B", "A")[:channels],
            numbers=(numbers,) * channels,
            origin=(0, 0),
            display=(0, 0, width, height),
            associated=False,
            space="",
            attributes=attributes or {},
        )
        return cls(pixels=pixels, encoding=encoding, numbers=numbers, grey=False, stored=stored)

    @property
    def values(self) -> NDArray[Any]:
        """The pixels; a grey image has one colour channel here instead of three equal ones."""
        return self.pixels[:, :, [0, *range(3, self.pixels.shape[2])] if self.grey else slice(None)]


def checked_pixels(name: str, image: NDArray[Any]) -> NDArray[Any]:
    """Return an array of an image file's values as (H, W, C)."""
    if not isinstance(image, np.ndarray):
        raise TypeError(f"{name}: an array is needed, not {type(image).__name__}")
    image = plain_array(image, name)
    if image.dtype.name not in (kinds := (*PIXEL_TYPES, "float64")):
        raise TypeError(f"{name}: dtype {image.dtype} is not one of {', '.join(kinds)}")
    if image.ndim not in (2, 3) or image.size == 0:
        raise ValueError(
            f"{name}: shape {image.shape} is not (H, W) or (H, W, C) with sides of at least 1"
        )
    return np.atleast_3d(native_order(image))


def check_name(path: str | os.PathLike[str]) -> str:
    """Return a file name, which must be text."""
    if not isinstance(path, str | os.PathLike) or isinstance(name := os.fspath(path), bytes):
        raise TypeError(
            f"path: {path!r} is not a str or a path"
            + "; use os.fsdecode(path)" * isinstance(path, bytes)
        )
    if not is_name(name):
        encoding = sys.getfilesystemencoding()
        locale = "" if encoding == "utf-8" else f", nor {encoding}, the locale's encoding"
        raise ValueError(
            f"path: {name!r} is not UTF-8{locale}; rename the image file or its folder"
        )
    return name


def listed(names: Iterable[str]) -> str:
    """Return names of a file in a message: a file may have thousands, of any length."""
    chosen = [*names]
    shown = [
        name if len(name) <= _MAX_NAME else f"{name[: _MAX_NAME - 3]}..."
        for name in chosen[:_MAX_NAMES]
    ]
    more = [f"... ({len(chosen)} in all)"] * (len(chosen) > _MAX_NAMES)
    return ", ".join([*shown, *more])


def is_exr(path: Path) -> bool:
    """Return whether a file name has the extension of OpenEXR."""
    return path.suffix.lower() == ".exr"


def is_kept(attribute: str) -> bool:
    """Return whether an attribute, by OpenImageIO's name, is also valid for the result."""
    return attribute not in _LOST_ATTRIBUTES and (
        attribute in _KEPT_ATTRIBUTES or attribute.startswith(_KEPT_GROUPS)
    )


def complete(pixels: NDArray[Any] | None, reader: Any, file: object) -> NDArray[Any]:
    """Return the pixels that a reader gave, or raise ValueError if the file is damaged."""
    # A truncated JPEG has pixels and an error.
    reason = failure_of(reader)
    if pixels is None or reason:
        raise ValueError(f"{file}: damaged: {reason or 'the pixels cannot be read'}")
    return pixels


def warnings_of(reader: Any, file: object) -> list[str]:
    """Return notes about warnings that a reader has left, or raise ValueError for an error."""
    reason = failure_of(reader)
    if (extra := _EXTRA_BYTES.search(reason)) is not None:
        return [f"{extra[1]} bytes of the file belong to no pixel and are ignored"]
    if reason:
        raise ValueError(f"{file}: damaged: {reason}")
    return []


def failure_of(source: Any) -> str:
    """Return and clear the error of an OpenImageIO object in one line; "" if there is none."""
    try:
        text: str = source.geterror()
    except UnicodeDecodeError as error:
        # The message quotes bytes of a damaged file.
        text = error.object.decode(errors="replace")
    return "; ".join(dict.fromkeys(filter(None, map(str.strip, text.splitlines()))))
