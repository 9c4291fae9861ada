"""Facts of Photoshop files: grey with alpha is over white."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.formats.facts import Corrected, Facts
from vkbloom._io.picture import Alpha

if TYPE_CHECKING:
    import OpenImageIO

# A step of 8 bits, for colours over white.
_STEP: Final = 1 / 255


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return the channels, and what takes the white away, which OpenImageIO does of RGB."""
    names = tuple(spec.channelnames)
    channels = ("Y", *names[1:]) if names[0] == "I" else names
    if names[:2] == ("R", "G") == names:
        channels = ("Y", "A")
    is_over_white = not part and channels == ("Y", "A")
    return Facts(channels=channels, correct=_without_white if is_over_white else None)


def is_grey(path: str) -> bool:
    """Whether the colour mode of a file is grey."""
    with open(path, "rb") as stream:
        return stream.read(26)[24:] == b"\0\1"


def _without_white(pixels: NDArray[Any]) -> Corrected:
    """Return colours times alpha of a picture that is over white.

    Colours that are darker than the share of white are not over white. Some programs write straight
    colours.
    """
    unit = 1.0 if pixels.dtype.kind == "f" else float(np.iinfo(pixels.dtype).max)
    white = unit - pixels[:, :, -1:].astype(np.float32)
    colours = pixels[:, :, :-1] - white
    if colours.size and colours.min() < -2 * _STEP * unit:
        return Corrected(pixels)
    made = pixels.copy()
    made[:, :, :-1] = np.maximum(colours, 0)
    return Corrected(made, alpha=Alpha.MULTIPLIED)
