"""Images of files, as stored and as decoded for a renderer.

Bloom is computed on linear values: images are decoded before, and encoded after it if the file has
integers.

=========================== ============================= ==========
number type of the file     read as                       written as
=========================== ============================= ==========
integers of 8 or 16 bits    sRGB, unless the file says    sRGB
                            that it is linear
half, float                 linear                        linear
=========================== ============================= ==========
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "DTYPES",
    "KEPT_ATTRIBUTES",
    "SPACES",
    "Colour",
    "Encoding",
    "Picture",
    "StoredImage",
    "Window",
    "check_name",
    "failure_of",
]

Colour = Literal["linear", "srgb"]
Encoding = Literal["linear", "srgb", "gamma22"]
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

# OpenImageIO's names of colour spaces.
SPACES: Final[Mapping[str, str]] = {
    "linear": "lin_rec709_scene",
    "srgb": "srgb_rec709_scene",
    "gamma22": "g22_rec709_scene",
}

# Attributes of colours and pixels that are also true of the image with bloom.
KEPT_ATTRIBUTES: Final = ("chromaticities", "PixelAspectRatio")


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredImage:
    """An image as stored in a file: every channel, no value changed.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, C)
        uint8, uint16, float16 or float32 (also for doubles), top row first, turned upright if the
        file has an orientation. They cover the data window and the display window; pixels without
        data are 0.
    channels : tuple of str
        The names of the C channels, such as ("R", "G", "B", "A").
    numbers : tuple of str
        OpenImageIO's name of each channel's number type: "uint8", "uint16", "half", "float" or
        "double".
    origin : (int, int)
        Position of the first pixel in the file's coordinates.
    display : (int, int, int, int)
        The display window (x, y, width, height), in the file's coordinates.
    associated : bool
        Whether the file's format says that colours are multiplied by alpha.
    space : str
        OpenImageIO's name of the file's colour space; "" if the file has none.
    attributes : mapping of str to (OpenImageIO.TypeDesc, value)
        The attributes that `save` keeps.
    parts : tuple of str
        The names of the file's parts, at most the first 100; "" for a part without a name.
    """

    pixels: NDArray[Any]
    channels: tuple[str, ...]
    numbers: tuple[str, ...]
    origin: tuple[int, int]
    display: Window
    associated: bool
    space: str
    attributes: Mapping[str, tuple[Any, Any]]
    parts: tuple[str, ...] = ("",)


@dataclass(frozen=True, eq=False, kw_only=True)
class Picture:
    """An image that `vkbloom.Renderer.apply` accepts, and the data to write it to a file.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3) or (H, W, 4)
        uint8, float16 or float32; grey images have three equal colours.
    encoding : {"linear", "srgb", "gamma22"} or None
        Encoding of the colours. None: not known, because the values were not decoded.
    numbers : str
        OpenImageIO's name of the number type in the file.
    grey : bool
        Whether the file has one colour channel instead of three.
    stored : StoredImage
        The image as stored in the file.
    notes : tuple of str
        Notes for the user about how the file was read.
    """

    pixels: NDArray[Any]
    encoding: Encoding | None
    numbers: str
    grey: bool
    stored: StoredImage
    notes: tuple[str, ...] = ()

    @classmethod
    def of_values(cls, pixels: NDArray[Any], numbers: str = "uint8") -> Self:
        """Make a picture whose values `save` writes without encoding; 1.0 is white.

        Parameters
        ----------
        pixels : ndarray, shape (H, W, 3) or (H, W, 4)
            uint8, float16 or float32.
        numbers : str
            OpenImageIO's name of the number type to write, if the format has it.
        """
        height, width, channels = pixels.shape
        stored = StoredImage(
            pixels=pixels,
            channels=("R", "G", "B", "A")[:channels],
            numbers=(numbers,) * channels,
            origin=(0, 0),
            display=(0, 0, width, height),
            associated=False,
            space="",
            attributes={},
        )
        return cls(pixels=pixels, encoding=None, numbers=numbers, grey=False, stored=stored)

    @property
    def values(self) -> NDArray[Any]:
        """The pixels; a grey image has one colour channel here instead of three equal ones."""
        return self.pixels[:, :, [0, *range(3, self.pixels.shape[2])] if self.grey else slice(None)]


def check_name(path: str | os.PathLike[str]) -> None:
    """Raise ValueError for a file name that is not UTF-8, which OpenImageIO does not accept."""
    name = os.fspath(path)
    try:
        name.encode()
    except UnicodeEncodeError:
        raise ValueError(
            f"path: {name!r} is not UTF-8; rename the image file or its folder"
        ) from None


def failure_of(source: Any) -> str:
    """Return and clear the error of an OpenImageIO object; "" if there is none.

    Parameters
    ----------
    source : OpenImageIO.ImageInput or module
        OpenImageIO prints an error that nobody has read when the object is destroyed.
    """
    try:
        text: str = source.geterror()
    except UnicodeDecodeError as error:
        # The message quotes bytes of a damaged file.
        text = error.object.decode(errors="replace")
    return text.strip()
