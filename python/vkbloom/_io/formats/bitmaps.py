"""Facts of BMP, DDS, ICO and Targa files: whether a fourth byte is alpha, and of what kind."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.formats.facts import Corrected, Facts
from vkbloom._io.picture import Alpha

if TYPE_CHECKING:
    import OpenImageIO

# BMP's compressions whose pixels have masks: BI_BITFIELDS, BI_ALPHABITFIELDS.
_WITH_MASKS: Final = (3, 6)
# The attributes type of Targa's extension area (Truevision TGA 2.0, field 24).
_TARGA_TYPES: Final = {0: Alpha.NONE, 1: Alpha.NONE, 4: Alpha.MULTIPLIED}
# The alpha mode of the DX10 header (DDS_HEADER_DXT10, miscFlags2).
_DDS_MODES: Final = (Alpha.UNKNOWN, Alpha.STRAIGHT, Alpha.MULTIPLIED, Alpha.NONE, Alpha.NONE)


def find_bmp_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return the alpha, and a function that takes the channels from where the masks name them."""
    masks = _bmp_masks(stream)
    if masks is None:
        return Facts(alpha=Alpha.UNKNOWN)

    def unpack(pixels: NDArray[Any]) -> Corrected:
        return Corrected(_unpack_masks(pixels, masks) if pixels.shape[2] == 4 else pixels)

    return Facts(alpha=Alpha.STRAIGHT if masks[3] else Alpha.NONE, correct=unpack)


def _bmp_masks(stream: BinaryIO) -> tuple[int, ...] | None:
    """Return the masks of red, green, blue and alpha of a file of 32 bits, if it has them."""
    head = stream.read(70)
    size, compression = (int.from_bytes(head[at : at + 4], "little") for at in (14, 30))
    if compression not in _WITH_MASKS or size < 40:
        return None
    count = 4 if size >= 56 or compression == _WITH_MASKS[1] else 3
    masks = tuple(
        int.from_bytes(head[at : at + 4], "little") for at in range(54, 54 + 4 * count, 4)
    )
    return (*masks, 0)[:4] if all(masks[:3]) else None


def _unpack_masks(pixels: NDArray[Any], masks: tuple[int, ...]) -> NDArray[Any]:
    """Return pixels with the channels that masks name."""
    words = pixels[:, :, [2, 1, 0, 3]].copy().view("<u4")[:, :, 0]
    made = np.zeros_like(pixels)
    for channel, mask in enumerate(masks):
        if mask:
            shift = (mask & -mask).bit_length() - 1
            largest = mask >> shift
            values = ((words & np.uint32(mask)) >> np.uint32(shift)).astype(np.float64)
            made[:, :, channel] = np.rint(values * (255 / largest))
    return made


def find_targa_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return the alpha, of the extension area."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(size - 26, 0))
    footer = stream.read(26)
    start = int.from_bytes(footer[:4], "little")
    if footer[8:24] != b"TRUEVISION-XFILE" or not start:
        return Facts(alpha=Alpha.UNKNOWN)
    stream.seek(start)
    area = stream.read(495)
    if len(area) < 495:
        return Facts(alpha=Alpha.UNKNOWN)
    return Facts(alpha=_TARGA_TYPES.get(area[494], Alpha.STRAIGHT))


def find_dds_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return the alpha, of the DX10 header."""
    header = stream.read(148)
    mode = header[144] & 7 if header[84:88] == b"DX10" and len(header) == 148 else 0
    return Facts(alpha=_DDS_MODES[mode] if mode < len(_DDS_MODES) else Alpha.UNKNOWN)


def find_ico_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return the alpha, of which the file says nothing."""
    return Facts(alpha=Alpha.UNKNOWN)
