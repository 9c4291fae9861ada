"""Facts of JPEG 2000 files (ISO/IEC 15444-1): alpha, signed numbers, subsampled channels."""

from __future__ import annotations

import functools
import struct
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.formats.facts import Corrected, Facts
from vkbloom._io.picture import Alpha

if TYPE_CHECKING:
    import OpenImageIO

# Bytes that are looked at for boxes before the pixels and the header of the codestream.
_HEADER_BYTES: Final = 1 << 16
# Start of the codestream, and its marker SIZ (ISO/IEC 15444-1, A.5.1).
_SIZE_MARKER: Final = b"\xff\x4f\xff\x51"
# The enumerated colour space of luminance and colour differences in the box "colr" (I.5.3.3).
_YCC: Final = (b"colr\1", 18)
_MAX_CHANNELS: Final = 16384
# The capability of ISO/IEC 15444-15.
_HIGH_THROUGHPUT: Final = 1 << 14


class _Channels(NamedTuple):
    """What the header of a codestream says of its channels."""

    bits: list[int]
    is_high_throughput: bool
    is_signed: bool
    is_subsampled: bool


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return the alpha, and a function that puts the numbers on the canvas."""
    head = stream.read(_HEADER_BYTES)
    channels = _channels_of(head)
    correct = None
    if channels is not None:
        correct = functools.partial(_on_canvas, stream.name, spec, head, channels)
    return Facts(alpha=_alpha_of(head), correct=correct)


def _alpha_of(head: bytes) -> Alpha:
    """Return the type of the channel definition box (ISO/IEC 15444-1, I.5.3.6)."""
    start = head.find(b"cdef") + 4
    if start >= 4:
        count = int.from_bytes(head[start : start + 2], "big")
        for at in range(start + 2, min(start + 2 + 6 * count, len(head) - 5), 6):
            if head[at + 2 : at + 4] == b"\0\2":
                return Alpha.MULTIPLIED
    return Alpha.STRAIGHT


def _on_canvas(
    name: str,
    spec: OpenImageIO.ImageSpec,
    head: bytes,
    channels: _Channels,
    pixels: NDArray[Any],
) -> Corrected:
    """Return the pixels on the canvas, with 0 as the middle of signed ones."""
    # OpenImageIO gives the canvas's right and lower ends for its width and height.
    width, height = spec.full_width - spec.full_x, spec.full_height - spec.full_y
    if channels.is_subsampled and (spec.full_x, spec.full_y) != (0, 0):
        raise ValueError(
            f"{name}: JPEG 2000 with subsampled colours is not supported where the picture begins "
            f"at {spec.full_x} {spec.full_y} and not at 0 0; convert it with opj_decompress"
        )
    if channels.is_signed:
        at = head.find(_YCC[0]) + 7
        is_ycc = at >= 7 and int.from_bytes(head[at : at + 4], "big") == _YCC[1]
        size = 8 * pixels.dtype.itemsize
        # Another library reads files of part 15.
        if is_ycc or channels.is_high_throughput or set(channels.bits) != {size}:
            raise ValueError(
                f"{name}: JPEG 2000 with signed numbers of {channels.bits[0]} bits is not "
                "supported; convert it to unsigned ones with opj_decompress"
            )
        # OpenImageIO adds 2 to the power of half the bits less 1.
        wrong, middle = 1 << (size // 2 - 1), 1 << (size - 1)
        pixels = pixels + pixels.dtype.type(middle - wrong)
    if channels.is_subsampled and pixels.shape[2] == 3 and b"colr" not in head:
        pixels = _from_ycc(pixels)
    return Corrected(pixels[:height, :width])


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
