"""Displays: the luminance in cd/m2 that stands for the values of a picture."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, Final, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import LUMINANCE
from vkbloom._io.chromaticities import CHROMATICITIES
from vkbloom._io.hdr_curves import DECODERS, SCENE, WHITE
from vkbloom._io.icc import from_chromaticities
from vkbloom._io.srgb import decode_srgb
from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom._spelling import did_you_mean

Encoding = Literal["srgb", "pq", "hlg"]
Primaries = Literal["rec709", "rec2020", "p3"]

# The white of SDR by which 0.1 of it is 20 cd/m2, and the largest luminance of PQ and of the
# reference display of HLG (Rec. ITU-R BT.2100-3, tables 4 and 5).
_SDR_WHITE: Final = 200.0
_PQ_PEAK: Final = 1e4
_HLG_PEAK: Final = 1000.0
# The power of a display whose gamma is below 1 has no value for black.
_MIN_SCENE: Final = 1e-12


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class Display:
    """The display that shows a sequence.

    Integers are its signal. Floats are linear light in Rec. 709 primaries, where 1 is the white.
    The signal of PQ stands for absolute luminances, whatever the white is.

    Parameters
    ----------
    encoding : {"srgb", "pq", "hlg"}
        Curve of integers: that of sRGB, or PQ or HLG of Rec. ITU-R BT.2100.
    white : float, optional
        Luminance of a value of 1 in cd/m2, 1 to 10000, as `Settings.reference_white`. Default: 200
        for "srgb", 203 for "pq". It follows from `peak` for "hlg", where 1 has the signal 0.75.
    peak : float, optional
        The largest luminance in cd/m2, 1 to 10000; what is above it is clamped. Default: the white
        for "srgb", 10000 for "pq", and 1000 for "hlg", where the gamma of the system follows from
        it.
    primaries : {"rec709", "rec2020", "p3"}, optional
        Primaries of integers. Default: "rec709" for "srgb", else "rec2020".
    """

    encoding: Encoding = "srgb"
    white: float | None = None
    peak: float | None = None
    primaries: Primaries | None = None

    def __post_init__(self) -> None:
        _check_choice("encoding", self.encoding, get_args(Encoding))
        if self.primaries is not None:
            _check_choice("primaries", self.primaries, get_args(Primaries))
        for name in ("white", "peak"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), 1.0, 1e4)
        if self.encoding == "hlg" and self.white is not None:
            raise ValueError('white: that of "hlg" follows from its peak; leave it out')

    @property
    def is_hdr(self) -> bool:
        """Whether it shows values above its white."""
        return self.encoding != "srgb"

    @property
    def highest(self) -> float:
        """The largest luminance in cd/m2."""
        if self.peak is not None:
            return self.peak
        if self.encoding == "srgb":
            return self.white_luminance
        return _PQ_PEAK if self.encoding == "pq" else _HLG_PEAK

    @property
    def white_luminance(self) -> float:
        """Luminance of a value of 1 in cd/m2."""
        if self.encoding == "hlg":
            return self.highest * math.pow(SCENE, _system_gamma(self.highest))
        return self.white or (WHITE if self.encoding == "pq" else _SDR_WHITE)

    def light_of(self, frame: NDArray[Any]) -> NDArray[np.float64]:
        """Return the linear light of a picture in cd/m2 for Rec. 709 primaries.

        - `frame`: shape (H, W, C) of integers or floats; channels after the third are ignored.
          NaN counts as 0.
        - Returns: shape (H, W, 3), 0 to `highest`.
        """
        colours = frame[..., :3]
        if colours.dtype.kind == "f":
            light = np.nan_to_num(colours.astype(np.float64))
        else:
            light = _decode(colours, self.encoding)
            primaries = self.primaries or ("rec2020" if self.is_hdr else "rec709")
            if primaries != "rec709":
                light = light @ from_chromaticities(CHROMATICITIES[primaries]).T
        light = np.maximum(light, 0)
        if self.encoding == "hlg":
            scene = np.minimum(SCENE * light, 1)
            luminance = np.maximum(scene @ np.array(LUMINANCE), _MIN_SCENE)
            shared = luminance ** (_system_gamma(self.highest) - 1)
            shown = self.highest * shared[..., np.newaxis] * scene
        else:
            is_absolute = self.encoding == "pq" and colours.dtype.kind != "f"
            shown = (WHITE if is_absolute else self.white_luminance) * light
        return np.asarray(np.minimum(shown, self.highest), np.float64)


def as_display(display: Display | str | None) -> Display:
    """Return a display, of that of a name; None: SDR."""
    if display is None:
        return Display()
    if isinstance(display, Display):
        return display
    _check_choice("display", display, get_args(Encoding))
    return Display(encoding=cast("Encoding", display))


def _check_choice(name: str, value: object, known: tuple[str, ...]) -> None:
    if not isinstance(value, str):
        raise TypeError(f"{name}: {value!r} is not one of {', '.join(known)}")
    if value not in known:
        raise ValueError(
            f"{name}: {value!r} is not one of {', '.join(known)}{did_you_mean(value, known)}"
        )


def _system_gamma(peak: float) -> float:
    """Return the gamma of HLG by the peak of the display: BT.2100-3, table 5, note 5f."""
    if 400 <= peak <= 2000:
        return 1.2 + 0.42 * math.log10(peak / 1000)
    # Report ITU-R BT.2390, for other displays.
    return 1.2 * float(1.111 ** math.log2(peak / 1000))


@functools.lru_cache(maxsize=8)
def _table(encoding: str, levels: int) -> NDArray[np.float64]:
    signal = np.arange(levels) / (levels - 1)
    values = decode_srgb(signal) if encoding == "srgb" else DECODERS[encoding](signal)
    return np.asarray(values, np.float64)


def _decode(colours: NDArray[Any], encoding: str) -> NDArray[np.float64]:
    """Return linear colours of integers, where 1 is the white."""
    largest = int(np.iinfo(colours.dtype).max)
    if largest <= 0xFFFF:
        return np.asarray(_table(encoding, largest + 1)[colours], np.float64)
    signal = colours / largest
    return np.asarray(
        decode_srgb(signal) if encoding == "srgb" else DECODERS[encoding](signal), np.float64
    )
