"""Images of files, as stored and as decoded for a renderer.

Bloom is computed on linear values: images are decoded before, and encoded after it if the file has
integers.

==================== ========================= =====================================
numbers in the file  taken as                  written as
==================== ========================= =====================================
8 or 16 bit integers what the file says (ICC   by the ICC profile, in the
                     profile, gamma, cICP,     command apply, else sRGB
                     Exif), else sRGB
half, float          linear (but JPEG XL: what linear
                     the file says)
==================== ========================= =====================================
"""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import native_order, plain_array
from vkbloom._formats import Curve
from vkbloom._io.hdr_curves import HDR_CURVES
from vkbloom._io.icc import Profile

#: "linear", "srgb" or the name of a colour space of OpenColorIO.
Colour: TypeAlias = str
#: The colour encoding of a file to write.
SavedColour = Literal["linear", Curve]
#: x and y of red, green, blue and white.
Chromaticities: TypeAlias = tuple[float, ...]
#: x, y, width, height in pixels.
Window: TypeAlias = tuple[int, int, int, int]
#: Attributes by OpenImageIO's names, each with its type and value.
Attributes: TypeAlias = Mapping[str, tuple[Any, Any]]

# The dtype for reading each number type, by OpenImageIO's names.
DTYPES: Final[Mapping[str, np.dtype[Any]]] = {
    "uint8": np.dtype(np.uint8),
    "uint16": np.dtype(np.uint16),
    "half": np.dtype(np.float16),
    "float": np.dtype(np.float32),
    "double": np.dtype(np.float32),
}

#: What to do about another number type.
NUMBERS_ADVICE: Final = (
    "numbers of {} are not supported; use unsigned integers of 8 or 16 bits, or floats"
)
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

# Of names in a message: how many, and characters of each.
_MAX_NAMES: Final = 20
_MAX_NAME: Final = 255


class Highlights(enum.Enum):
    """What a file has of light above white: the one place that says what a photograph is."""

    #: Integers for SDR: everything brighter is clipped at 1, and can be expanded.
    CLIPPED = enum.auto()
    #: A photograph for SDR with a gain map, which gives values above 1.
    MAPPED = enum.auto()
    #: Floats, and integers on the curves PQ and HLG: values above 1 are stored.
    STORED = enum.auto()


#: What is a photograph: a file for SDR, with or without a gain map.
PHOTOGRAPHS: Final = (Highlights.CLIPPED, Highlights.MAPPED)


class Alpha(enum.Enum):
    """What alpha is to the colours of a file."""

    STRAIGHT = enum.auto()
    #: Colours are multiplied by alpha: encoded ones in files of integers.
    MULTIPLIED = enum.auto()
    #: The channel means nothing.
    NONE = enum.auto()
    #: Nothing if it is 0 everywhere, else colours are straight: the pixels tell.
    UNKNOWN = enum.auto()


class CodePoints(NamedTuple):
    """Code points of a file's colours (Rec. ITU-T H.273), as in a cICP chunk, by their names."""

    primaries: str
    curve: str
    is_narrow: bool


class StatedColours(NamedTuple):
    """What a file states of its colours.

    - `space`: OpenImageIO's name of the colour space; "" if there is none.
    - `gamma`: The exponent that decodes colours to light, if the file states one. It is more exact
      than `space`, and has precedence unless there are `code_points`.
    - `primaries`: The chromaticities that the file states without a profile, if they are others
      than those of Rec. 709. Colours are converted from them.
    - `said`: What the file says of its values that is not used, in words.
    - `code_points`: They have precedence over a profile (PNG, third edition). None: there are none,
      or they are not known.
    - `profile`, `profile_name`: The ICC profile, and the name in it.
    - `is_encoded`: Whether the values are on a curve: integers, and the floats of JPEG XL.
    - `has_gain_map`: Whether floats were made of integers by a gain map: light with the profile's
      primaries.
    """

    space: str = ""
    gamma: float | None = None
    primaries: Chromaticities | None = None
    said: tuple[str, ...] = ()
    code_points: CodePoints | None = None
    profile: bytes | None = None
    profile_name: str = ""
    is_encoded: bool = False
    has_gain_map: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Header:
    """What a part of an image file says of its pixels.

    - `channels`: The names of the C channels, such as ("R", "G", "B", "A"); "" for one without a
      meaning.
    - `numbers`: OpenImageIO's name of each channel's number type: "uint8", "uint16", "half",
      "float" or "double".
    - `origin`: Position of the first pixel in an OpenEXR file's coordinates, else (0, 0).
    - `display`: The display window (x, y, width, height), in the same coordinates.
    - `alpha`: What alpha is to colours. Encoded ones are divided by alpha when they are decoded,
      and are straight from then on.
    - `orientation`: That of TIFF and Exif, 1 to 8, which was undone.
    - `attributes`: Those that are also valid for the result, by OpenImageIO's names.
    - `exr_attributes`: Those that are only written from OpenEXR to OpenEXR.
    - `part`: The number of the part.
    """

    channels: tuple[str, ...]
    numbers: tuple[str, ...]
    display: Window
    origin: tuple[int, int] = (0, 0)
    alpha: Alpha = Alpha.STRAIGHT
    orientation: int = 1
    colours: StatedColours = StatedColours()
    attributes: Attributes = field(default_factory=dict)
    exr_attributes: Attributes = field(default_factory=dict)
    part: int = 0

    def highlights(self, colour: Colour | None = None) -> Highlights:
        """Return what there is of light above white; `colour`: instead of the stated space."""
        if self.colours.has_gain_map:
            return Highlights.MAPPED
        points = self.colours.code_points
        is_hdr = colour is None and points is not None and points.curve in HDR_CURVES
        is_clipped = not is_hdr and {*self.numbers} <= {"uint8", "uint16"}
        return Highlights.CLIPPED if is_clipped else Highlights.STORED


@dataclass(frozen=True, eq=False, kw_only=True)
class Picture:
    """The pixels of an image, and what describes them: as stored in a file, or decoded.

    - `pixels`: ndarray, shape (H, W, C), top row first and upright.

      As stored, they have every channel with its values; uint8, uint16, float16 or float32 (also
      for doubles). They cover the data window and the display window; pixels without data are 0.

      Decoded, `vkbloom.Renderer.apply` accepts them: linear light of 3 or 4 channels, float16 or
      float32; grey images have three equal colours.
    - `header`: What the file says of them, or would say.
    - `numbers`: OpenImageIO's name of the number type in the file.
    - `encoding`: Encoding of the colours. None: not known, because the values were not decoded.
    - `colour`: The colour space from which colours were decoded: "linear", "srgb", the name of
      another space or of the file's profile; "" if the values were not decoded.
    - `grey`: Whether the file has one colour channel instead of three.
    - `highlights`: What the file has of light above white; of decoded pictures.
    - `expand`: What clipped highlights were expanded up to. A file of integers gets them
      compressed.
    - `profile`: Of a decoded picture: the ICC profile that a file of integers gets, in place of
      sRGB. See `decoding.keep_profile`.
    - `parts`: The names of the file's parts (the first 100), of which the pixels are one; "" for a
      part without a name.
    - `notes`: Notes for the user about how the file was read and interpreted.
    """

    pixels: NDArray[Any]
    header: Header
    numbers: str
    encoding: SavedColour | None = None
    colour: str = ""
    grey: bool = False
    highlights: Highlights = Highlights.STORED
    expand: float = 1.0
    profile: Profile | None = None
    parts: tuple[str, ...] = ("",)
    notes: tuple[str, ...] = ()

    @classmethod
    def of_values(
        cls,
        pixels: NDArray[Any],
        numbers: str = "uint8",
        encoding: SavedColour | None = None,
        attributes: Attributes | None = None,
    ) -> Self:
        """Make a picture from an array. Without an encoding, `save` writes its values unchanged."""
        height, width, channels = pixels.shape
        header = Header(
            channels=("R", "G", "B", "A")[:channels],
            numbers=(numbers,) * channels,
            display=(0, 0, width, height),
            attributes=attributes or {},
        )
        return cls(pixels=pixels, header=header, numbers=numbers, encoding=encoding)

    @property
    def is_photograph(self) -> bool:
        """Whether the file is a photograph for SDR, with or without a gain map."""
        # Only decoding knows the colour space that a caller gives in place of the file's own.
        highlights = self.highlights if self.colour else self.header.highlights()
        return highlights in PHOTOGRAPHS

    @property
    def is_multiplied(self) -> bool:
        """Whether the file's colours are multiplied by alpha."""
        return self.header.alpha is Alpha.MULTIPLIED

    @property
    def has_straight(self) -> bool:
        """Whether a decoded picture's file has alpha, and colours not multiplied by it."""
        return self.pixels.shape[2] == 4 and not self.is_multiplied

    @property
    def values(self) -> NDArray[Any]:
        """The pixels; a grey image has one colour channel here instead of three equal ones."""
        return self.pixels[:, :, [0, *range(3, self.pixels.shape[2])] if self.grey else slice(None)]


def check_pixels(name: str, image: NDArray[Any]) -> NDArray[Any]:
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


def list_all(names: Iterable[str]) -> str:
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
