"""The curves of Rec. ITU-R BT.2100-3 in files: PQ, where 1 is 203 cd/m2, and HLG; and of BT.709."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Curve = Callable[[NDArray[Any]], NDArray[np.float64]]

# Table 4, PQ; and Rec. ITU-R BT.2408: the luminance of diffuse white in cd/m2.
_M1, _M2 = 2610 / 16384, 2523 / 32
_C1, _C2, _C3 = 3424 / 4096, 2413 / 128, 2392 / 128
WHITE: Final = 203.0
# Table 5, HLG: its bright part is a ln(12 E - b) + c. A value of 1 is this E, the signal 0.75.
_A, _B = 0.17883277, 0.28466892
_C = 0.5 - _A * np.log(4 * _A)
SCENE: Final = 0.26496


def _pq(colours: NDArray[Any]) -> NDArray[np.float64]:
    luminance = np.clip(np.nan_to_num(colours.astype(float)) * (WHITE / 1e4), 0, 1)
    power = luminance**_M1
    signal: NDArray[np.float64] = ((_C1 + _C2 * power) / (1 + _C3 * power)) ** _M2
    return signal


def _from_pq(signal: NDArray[Any]) -> NDArray[np.float64]:
    power = signal.astype(float) ** (1 / _M2)
    share: NDArray[np.float64] = np.maximum(power - _C1, 0) / (_C2 - _C3 * power)
    luminance: NDArray[np.float64] = share ** (1 / _M1) * (1e4 / WHITE)
    return luminance


def _hlg(colours: NDArray[Any]) -> NDArray[np.float64]:
    light = np.clip(SCENE * np.nan_to_num(colours.astype(float)), 0, 1)
    bright = _A * np.log(np.maximum(12 * light - _B, 1e-9)) + _C
    signal: NDArray[np.float64] = np.where(light <= 1 / 12, np.sqrt(3 * light), bright)
    return signal


def _from_hlg(signal: NDArray[Any]) -> NDArray[np.float64]:
    values = signal.astype(float)
    bright = (np.exp((values - _C) / _A) + _B) / 12
    return np.where(values <= 0.5, values**2 / 3, bright) / SCENE


def _rec709(colours: NDArray[Any]) -> NDArray[np.float64]:
    """Rec. ITU-R BT.709-6, item 1.2, for 0 and above."""
    light = np.maximum(np.nan_to_num(colours.astype(float)), 0)
    signal: NDArray[np.float64] = np.where(light < 0.018, 4.5 * light, 1.099 * light**0.45 - 0.099)
    return signal


def _from_rec709(signal: NDArray[Any]) -> NDArray[np.float64]:
    """Rec. ITU-R BT.709-6, item 1.2."""
    values = signal.astype(float)
    return np.where(values < 0.081, values / 4.5, ((values + 0.099) / 1.099) ** (1 / 0.45))


#: From linear colours to the signal, 0..1.
ENCODERS: Final[Mapping[str, Curve]] = {"pq": _pq, "hlg": _hlg, "rec709": _rec709}
#: Curves for displays of HDR.
HDR_CURVES: Final = ("pq", "hlg")
#: From a signal of 0..1 to linear colours.
DECODERS: Final[Mapping[str, Curve]] = {
    "pq": _from_pq,
    "hlg": _from_hlg,
    "rec709": _from_rec709,
}
