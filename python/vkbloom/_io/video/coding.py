"""What the code values of a video mean, and the conversion between them and signals of colours.

Numbers are the code points of Rec. ITU-T H.273, which FFmpeg has as well. A signal is red, green
and blue before they are light, 0..1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

#: The planes of a frame: green, blue, red; luma and two colour differences; or luma alone.
Kind = Literal["rgb", "yuv", "grey"]
#: Codecs of videos that are written.
Codec = Literal["ffv1", "h264", "h265"]

#: Of matrices: the luma coefficients of red and blue (H.273, table 4).
MATRICES: Final[Mapping[int, tuple[float, float]]] = {
    1: (0.2126, 0.0722),  # BT.709
    4: (0.30, 0.11),  # FCC
    5: (0.299, 0.114),  # BT.601
    6: (0.299, 0.114),  # BT.601
    7: (0.212, 0.087),  # SMPTE 240M
    9: (0.2627, 0.0593),  # BT.2020, non-constant luminance
}
#: The code point of what is not stated.
UNSPECIFIED: Final = 2
#: Matrices of BT.709, BT.601 and BT.2020 (non-constant luminance).
BT709, BT601, BT2020 = 1, 6, 9
PQ: Final = 16
HLG: Final = 18
#: The curves PQ and HLG.
HDR_CURVES: Final = (PQ, HLG)
# Names of curves and primaries in messages.
_CURVE_NAMES: Final = {16: "BT.2100 PQ", 18: "BT.2100 HLG", 13: "sRGB", 8: "linear", 4: "gamma 2.2"}
_PRIMARY_NAMES: Final = {9: "BT.2020", 12: "Display P3"}
# Curves and primaries that decoding knows. BT.601's primaries are read as those of BT.709.
_CURVES: Final = (1, 4, 6, 8, 13, 14, 15, 16, 18)
_PRIMARIES: Final = (1, 9, 12)


@dataclass(frozen=True, kw_only=True)
class Coding:
    """How a video codes its colours.

    - `bits`: Of a code value, 8 to 16.
    - `shifts`: By how many halvings planes of colour differences are smaller, in x and y.
    - `matrix`: A code point; of grey, the one that luma is computed by.
    - `primaries`, `curve`: Code points.
    - `is_narrow`: Whether black is 16 and white 235 (of 8 bits), else 0 and 255.
    """

    kind: Kind
    bits: int
    shifts: tuple[int, int] = (0, 0)
    matrix: int = BT709
    primaries: int = UNSPECIFIED
    curve: int = UNSPECIFIED
    is_narrow: bool = False

    @property
    def is_hdr(self) -> bool:
        """Whether the curve is PQ or HLG."""
        return self.curve in HDR_CURVES

    @property
    def read_primaries(self) -> int:
        """The primaries that colours are converted from."""
        if self.primaries in _PRIMARIES:
            return self.primaries
        return 9 if self.is_hdr and self.primaries == UNSPECIFIED else 1

    @property
    def read_curve(self) -> int:
        """The curve that signals are decoded by."""
        return self.curve if self.curve in _CURVES else 1

    @property
    def name(self) -> str:
        """The colours in words."""
        curve = _CURVE_NAMES.get(self.read_curve, "BT.709")
        primaries = _PRIMARY_NAMES.get(self.read_primaries)
        return curve if primaries is None or self.is_hdr else f"{curve} with {primaries}"

    def notes(self) -> list[str]:
        """Return notes about code points that are taken as others."""
        said = []
        for what, point, taken in (
            ("primaries", self.primaries, self.read_primaries),
            ("transfer curve", self.curve, self.read_curve),
        ):
            if point not in (UNSPECIFIED, taken):
                said.append(f"the {what} of code point {point} are taken as code point {taken}")
        return said


def _scales(coding: Coding) -> tuple[float, float, float, float]:
    """Return offset and range of luma, and those of colour differences."""
    step = 1 << (coding.bits - 8)
    if coding.is_narrow:
        return 16.0 * step, 219.0 * step, 128.0 * step, 224.0 * step
    top = float((1 << coding.bits) - 1)
    return 0.0, top, 128.0 * step, top


def to_signal(planes: Sequence[NDArray[Any]], coding: Coding) -> NDArray[Any]:
    """Return the signal of a frame's planes.

    Returns: shape (H, W, 3), or (H, W, 1) of grey. uint8 (255 is 1) of red, green and blue of
    8 bits in full range, else uint16 (65535 is 1); clipped to 0..1. Each pixel has the nearest
    sample of a smaller plane, so that `to_planes` finds the same samples.
    """
    height, width = planes[0].shape
    offset, scale, middle, spread = _scales(coding)
    if coding.kind != "yuv":
        order = [0] if coding.kind == "grey" else [2, 0, 1]
        stacked = np.stack([planes[index] for index in order], axis=2)
        if coding.bits == 8 and not coding.is_narrow:
            return stacked
        return _as_16_bits((stacked.astype(np.float32) - offset) / np.float32(scale))
    red_share, blue_share = MATRICES[coding.matrix]
    luma = (planes[0].astype(np.float32) - np.float32(offset)) * np.float32(1 / scale)
    blue, red = (
        _enlarge((plane.astype(np.float32) - np.float32(middle)) * np.float32(1 / spread), coding)[
            :height, :width
        ]
        for plane in planes[1:3]
    )
    signal = np.empty((height, width, 3), np.float32)
    signal[:, :, 0] = luma + np.float32(2 * (1 - red_share)) * red
    signal[:, :, 2] = luma + np.float32(2 * (1 - blue_share)) * blue
    green_share = 1 - red_share - blue_share
    signal[:, :, 1] = luma - np.float32(2 * (1 - blue_share) * blue_share / green_share) * blue
    signal[:, :, 1] -= np.float32(2 * (1 - red_share) * red_share / green_share) * red
    return _as_16_bits(signal)


def to_planes(signal: NDArray[np.float32], coding: Coding) -> list[NDArray[Any]]:
    """Return the planes of a frame from a signal (H, W, 3) of 0..1, as uint8 or uint16.

    A sample of a smaller plane is the mean of its pixels.
    """
    offset, scale, middle, spread = _scales(coding)
    if coding.kind == "rgb":
        return [_as_codes(signal[:, :, index], scale, offset, coding) for index in (1, 2, 0)]
    red_share, blue_share = MATRICES[coding.matrix]
    shares = (red_share, 1 - red_share - blue_share, blue_share)
    luma = signal @ np.array(shares, np.float32)
    planes = [_as_codes(luma, scale, offset, coding)]
    if coding.kind == "yuv":
        for index, share in ((2, blue_share), (0, red_share)):
            difference = (signal[:, :, index] - luma) * np.float32(0.5 / (1 - share))
            planes.append(_as_codes(_reduce(difference, coding), spread, middle, coding))
    return planes


def _as_16_bits(values: NDArray[np.float32]) -> NDArray[np.uint16]:
    scaled = np.clip(values, 0, 1) * np.float32(65535) + np.float32(0.5)
    return scaled.astype(np.uint16)


def _as_codes(
    values: NDArray[np.float32], scale: float, offset: float, coding: Coding
) -> NDArray[Any]:
    codes = np.rint(values * np.float32(scale) + np.float32(offset))
    made: NDArray[Any] = np.clip(codes, 0, (1 << coding.bits) - 1)
    return made.astype(np.uint8 if coding.bits == 8 else np.uint16)


def _enlarge(plane: NDArray[Any], coding: Coding) -> NDArray[Any]:
    for axis, shift in ((1, coding.shifts[0]), (0, coding.shifts[1])):
        if shift:
            plane = np.repeat(plane, 1 << shift, axis=axis)
    return plane


def _reduce(values: NDArray[np.float32], coding: Coding) -> NDArray[np.float32]:
    """Return the means of blocks; the blocks at the border are filled with its pixels."""
    x, y = (1 << shift for shift in coding.shifts)
    if (x, y) == (1, 1):
        return values
    height, width = values.shape
    padded = np.pad(values, ((0, -height % y), (0, -width % x)), "edge")
    blocks = padded.reshape(padded.shape[0] // y, y, padded.shape[1] // x, x)
    means: NDArray[np.float32] = blocks.mean(axis=(1, 3), dtype=np.float32)
    return means
