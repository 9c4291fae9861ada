"""Correct what OpenImageIO's readers make of the values in a file.

================================ ===================================================================
format                           the reader
================================ ===================================================================
BMP with masks                   takes four bytes for blue, green, red and alpha
TIFF whose 0 is white            inverts numbers of 8 bits with their alpha, and no others
FITS with BSCALE and BZERO       returns numbers without scale and offset
JPEG 2000                        adds a wrong offset to signed numbers; rounds sizes up to multiples
                                 of the steps of subsampled channels; takes luminance and colour
                                 differences without a name as red, green, blue
Photoshop, grey with alpha       returns the picture over white, which it takes away from RGB
================================ ===================================================================
"""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.alpha import bmp_masks

if TYPE_CHECKING:
    import OpenImageIO

#: Signed numbers by OpenImageIO's names, which FITS files scale.
SIGNED: Final[Mapping[str, np.dtype[Any]]] = {
    "int16": np.dtype(np.int16),
    "int": np.dtype(np.int32),
}
# PhotometricInterpretation of TIFF 6.0 for grey whose 0 is white, and the compressions of JPEG,
# which libtiff inverts itself.
_WHITE_IS_0: Final = 0
_JPEG: Final = (6, 7)
# Bytes that are looked at for the header of a JPEG 2000 codestream.
_HEADER_BYTES: Final = 1 << 16
# Start of the codestream, and its marker SIZ (ISO/IEC 15444-1, A.5.1).
_SIZE_MARKER: Final = b"\xff\x4f\xff\x51"
# The enumerated colour space of luminance and colour differences in the box "colr" (I.5.3.3).
_YCC: Final = (b"colr\1", 18)
_MAX_CHANNELS: Final = 16384
# The capability of ISO/IEC 15444-15.
_HIGH_THROUGHPUT: Final = 1 << 14
# A step of 8 bits, for colours over white.
_STEP: Final = 1 / 255


class _Channels(NamedTuple):
    """What the header of a JPEG 2000 codestream says of its channels."""

    bits: list[int]
    is_high_throughput: bool
    is_signed: bool
    is_subsampled: bool


def corrected(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec, kind: str, path: str | os.PathLike[str]
) -> tuple[NDArray[Any], list[str]]:
    """Return the values (H, W, C) of the current part of a file, and notes.

    `kind`: OpenImageIO's name of the format.
    """
    match kind:
        case "bmp" if pixels.shape[2] == 4:
            return _by_masks(pixels, path), []
        case "tiff" if spec.get_int_attribute("tiff:PhotometricInterpretation", -1) == _WHITE_IS_0:
            return _with_black_0(pixels, spec)
        case "fits":
            return _scaled(pixels, spec)
        case "jpeg2000":
            return _within_canvas(pixels, spec, path), []
        case _:
            return pixels, []


def _by_masks(pixels: NDArray[Any], path: str | os.PathLike[str]) -> NDArray[Any]:
    """Return pixels with the channels that a BMP file's masks name."""
    if (masks := bmp_masks(path)) is None:
        return pixels
    words = pixels[:, :, [2, 1, 0, 3]].copy().view("<u4")[:, :, 0]
    made = np.zeros_like(pixels)
    for channel, mask in enumerate(masks):
        if mask:
            shift = (mask & -mask).bit_length() - 1
            largest = mask >> shift
            values = ((words & np.uint32(mask)) >> np.uint32(shift)).astype(np.float64)
            made[:, :, channel] = np.rint(values * (255 / largest))
    return made


def _with_black_0(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec
) -> tuple[NDArray[Any], list[str]]:
    """Return grey whose 0 is black; other channels as they are stored."""
    is_float = pixels.dtype.kind == "f"
    unit = pixels.dtype.type(1 if is_float else np.iinfo(pixels.dtype).max)
    is_inverted = pixels.dtype == np.uint8
    if is_inverted and spec.get_int_attribute("tiff:Compression") in _JPEG:
        return pixels, []
    made = pixels.copy()
    wrong = slice(1, None) if is_inverted else slice(0, 1)
    made[:, :, wrong] = unit - made[:, :, wrong]
    # TIFF 6.0 defines it for integers.
    said = "the file says that 0 is white; its floats are taken as 1 minus the light"
    return made, [said] if is_float else []


def scale_of(spec: OpenImageIO.ImageSpec) -> tuple[float, float]:
    """Return what a FITS file multiplies its numbers by, and what it adds to them."""
    factor, offset = (
        spec.get_float_attribute(name, default) for name, default in (("Bscale", 1), ("Bzero", 0))
    )
    return factor, offset


def _scaled(pixels: NDArray[Any], spec: OpenImageIO.ImageSpec) -> tuple[NDArray[Any], list[str]]:
    """Return the physical values of a FITS file (FITS 4.0, 4.4.2.5): BZERO + BSCALE x stored."""
    factor, offset = scale_of(spec)
    if (factor, offset) == (1, 0):
        return pixels, []
    if (factor, offset) == (1, 32768) and pixels.dtype == np.int16:
        # FITS has no unsigned numbers of 16 bits (table 11).
        return pixels.view(np.uint16) ^ np.uint16(32768), []
    with np.errstate(over="ignore", invalid="ignore"):
        made = (pixels * np.float64(factor) + offset).astype(np.float32)
    return made, [
        f"its values are BSCALE {factor:.6g} times the stored ones plus BZERO {offset:.6g}"
    ]


def _within_canvas(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec, path: str | os.PathLike[str]
) -> NDArray[Any]:
    """Return the pixels of a JPEG 2000 file on its canvas, with 0 as the middle of signed ones."""
    # OpenImageIO gives the canvas's right and lower ends for its width and height.
    width, height = spec.full_width - spec.full_x, spec.full_height - spec.full_y
    with open(path, "rb") as stream:
        head = stream.read(_HEADER_BYTES)
    channels = _channels_of(head)
    if channels is None:
        return pixels
    if channels.is_subsampled and (spec.full_x, spec.full_y) != (0, 0):
        raise ValueError(
            f"{os.fspath(path)}: JPEG 2000 with subsampled colours is not supported where the "
            f"picture begins at {spec.full_x} {spec.full_y} and not at 0 0; convert it with "
            "opj_decompress"
        )
    if channels.is_signed:
        at = head.find(_YCC[0]) + 7
        is_ycc = at >= 7 and int.from_bytes(head[at : at + 4], "big") == _YCC[1]
        size = 8 * pixels.dtype.itemsize
        # Another library reads files of part 15.
        if is_ycc or channels.is_high_throughput or set(channels.bits) != {size}:
            raise ValueError(
                f"{os.fspath(path)}: JPEG 2000 with signed numbers of {channels.bits[0]} bits is "
                "not supported; convert it to unsigned ones with opj_decompress"
            )
        # OpenImageIO adds 2 to the power of half the bits less 1.
        wrong, middle = 1 << (size // 2 - 1), 1 << (size - 1)
        pixels = pixels + pixels.dtype.type(middle - wrong)
    if channels.is_subsampled and pixels.shape[2] == 3 and b"colr" not in head:
        pixels = _from_ycc(pixels)
    return pixels[:height, :width]


def _from_ycc(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return red, green, blue of luminance and colour differences (Rec. ITU-R BT.601-7, 2.5)."""
    largest = np.iinfo(pixels.dtype).max
    light, blue, red = (pixels.astype(np.float32) - (0, largest // 2 + 1, largest // 2 + 1)).T
    made = np.stack(
        [light + 1.402 * red, light - 0.344136 * blue - 0.714136 * red, light + 1.772 * blue]
    ).T
    rounded: NDArray[Any] = np.rint(np.clip(made, 0, largest)).astype(pixels.dtype)
    return rounded


def _channels_of(head: bytes) -> _Channels | None:
    at = head.find(_SIZE_MARKER)
    # The length of the segment, capabilities, four sizes with positions, and the number.
    start = at + 4 + 2 + 2 + 8 * 4
    if at < 0 or len(head) < start + 2:
        return None
    (count,) = struct.unpack_from(">H", head, start)
    listed = head[start + 2 : start + 2 + 3 * min(count, _MAX_CHANNELS)]
    (capabilities,) = struct.unpack_from(">H", head, at + 6)
    depths, columns, rows = listed[::3], listed[1::3], listed[2::3]
    return _Channels(
        is_high_throughput=bool(capabilities & _HIGH_THROUGHPUT),
        bits=[(depth & 127) + 1 for depth in depths],
        is_signed=any(depth & 128 for depth in depths),
        is_subsampled=any(step != 1 for step in columns + rows),
    )


def without_white(pixels: NDArray[Any]) -> NDArray[Any] | None:
    """Return colours times alpha of a grey Photoshop file's picture, which is over white.

    None: the colours are not over white, since they are darker than the share of white. Some
    programs write straight colours.
    """
    unit = 1.0 if pixels.dtype.kind == "f" else float(np.iinfo(pixels.dtype).max)
    white = unit - pixels[:, :, -1:].astype(np.float32)
    colours = pixels[:, :, :-1] - white
    if colours.size and colours.min() < -2 * _STEP * unit:
        return None
    made = pixels.copy()
    made[:, :, :-1] = np.maximum(colours, 0)
    return made
