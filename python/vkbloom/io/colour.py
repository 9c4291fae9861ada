"""Convert colours of image files to linear Rec. 709, with the OpenColorIO that is in OpenImageIO.

The colour spaces are those of OpenColorIO's built-in configuration, so that results do not depend
on the machine's configuration.
"""

from __future__ import annotations

import tempfile
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.io.srgb import decode_srgb

__all__ = ["check_space", "from_profile", "from_space", "is_srgb_profile"]

_CONFIGURATION: Final = "ocio://default"
_LINEAR: Final = "lin_rec709_scene"
# The colour space to which OpenColorIO converts from an ICC profile.
_CONNECTION: Final = "CIE XYZ-D65 - Scene-referred"
# Half an 8-bit level, encoded. A profile that differs by less from sRGB counts as sRGB.
_SAME: Final = 0.5 / 255


def check_space(name: str) -> None:
    """Raise ValueError if the built-in configuration has no colour space of this name."""
    oiio = import_extra("OpenImageIO", "images", "Converting colours")
    config = oiio.ColorConfig(_CONFIGURATION)
    if not config.resolve(name) or config.getColorSpaceIndex(name) < 0:
        raise ValueError(
            f"colour: {name!r} is not linear, srgb or a colour space of OpenColorIO's built-in "
            f"configuration: {', '.join(config.getColorSpaceNames())}"
        )


def from_space(colours: NDArray[np.float32], space: str) -> NDArray[np.float32]:
    """Convert colours of a named space to linear Rec. 709.

    - `colours`: ndarray of float32, shape (H, W, 3).
    - Returns: ndarray of float32, shape (H, W, 3): not clipped.
    """
    oiio = import_extra("OpenImageIO", "images", "Converting colours")
    check_space(space)
    converted = oiio.ImageBufAlgo.colorconvert(
        oiio.ImageBuf(np.ascontiguousarray(colours)),
        space,
        _LINEAR,
        unpremult=False,
        colorconfig=_CONFIGURATION,
    )
    return _pixels(converted)


def from_profile(colours: NDArray[np.float32], profile: bytes) -> NDArray[np.float32]:
    """Convert colours that an ICC profile describes to linear Rec. 709.

    - `colours`: ndarray of float32, shape (H, W, 3); 0..1.
    - `profile`: An RGB profile of a matrix and curves, such as those of sRGB, Display P3 and Adobe
      RGB.
    - Returns: ndarray of float32, shape (H, W, 3): not clipped: colours outside of Rec. 709 have
      negative components.
    """
    oiio = import_extra("OpenImageIO", "images", "Converting colours")
    # A new name each time, since OpenColorIO caches files by name.
    with tempfile.NamedTemporaryFile(suffix=".icc") as file:
        file.write(profile)
        file.flush()
        converted = oiio.ImageBufAlgo.ociofiletransform(
            oiio.ImageBuf(np.ascontiguousarray(colours)),
            file.name,
            unpremult=False,
            # The other direction is from XYZ to the device.
            inverse=True,
            colorconfig=_CONFIGURATION,
        )
    return from_space(_pixels(converted), _CONNECTION)


def is_srgb_profile(profile: bytes) -> bool:
    """Tell whether an ICC profile means sRGB, within half a level of 8 bits."""
    levels = np.linspace(0, 1, 6, dtype=np.float32)
    probe = np.stack(np.meshgrid(levels, levels, levels), -1).reshape(6, 36, 3)
    expected = decode_srgb(probe)
    # Where the curve is flat, the same encoded difference is a smaller linear one.
    slope = np.maximum((decode_srgb(probe + np.float32(0.01)) - expected) / 0.01, 1 / 12.92)
    difference = np.abs(from_profile(probe, profile) - expected)
    return bool((difference <= _SAME * slope).all())


def _pixels(buffer: Any) -> NDArray[np.float32]:
    if buffer.has_error:
        raise ValueError(" ".join(buffer.geterror().split()))
    pixels: NDArray[np.float32] = buffer.get_pixels()
    return pixels
