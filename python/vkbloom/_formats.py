"""Dtypes of images, their formats, the largest floats; curves and luminance of colours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal

#: The format of an image by its dtype: what the core reads and writes.
FORMATS_BY_DTYPE: Final[Mapping[str, str]] = {
    "uint8": "rgba8unorm",
    "float16": "rgba16float",
    "float32": "rgba32float",
}
#: The dtypes of images.
IMAGE_DTYPES: Final = tuple(FORMATS_BY_DTYPE)

#: The largest 16-bit and 32-bit float. The device computes in 32-bit floats.
MAX_HALF: Final = 65504.0
MAX_FLOAT: Final = (2 - 2**-23) * 2.0**127

#: Curves that encode colours.
Curve = Literal["gamma22", "srgb", "pq", "hlg"]

#: Red, green and blue of the luminance of Rec. ITU-R BT.709, with four digits, and with the seven
#: that Unity and three.js have.
LUMINANCE: Final = (0.2126, 0.7152, 0.0722)
LUMINANCE_7_DIGITS: Final = (0.2126729, 0.7151522, 0.0721750)
