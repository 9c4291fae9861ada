"""Chromaticities of primaries and white, as files state them."""

from __future__ import annotations

from typing import Final

import numpy as np

from vkbloom._io.picture import Chromaticities

# Red, green, blue, white, as x and y: Rec. ITU-R BT.709 and BT.2020, SMPTE EG 432-1.
CHROMATICITIES: Final = {
    "rec709": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "rec2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    "p3": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
}
#: Adobe RGB (1998), 4.3.1.1 and 4.3.4.2.
ADOBE: Final = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
ADOBE_GAMMA: Final = 563 / 256
# How far coordinates may be off, as they are rounded.
_ROUNDED: Final = 2e-3


def other_primaries(numbers: list[float]) -> Chromaticities | None:
    """Return chromaticities that are others than those of Rec. 709; None: they are not, or none."""
    values = np.array(numbers, np.float64)
    if values.size != 8 or not np.isfinite(values).all():
        return None
    x, y = values.reshape(4, 2).T
    corners = np.stack([x, y, 1 - x - y])
    is_possible = (y > 0).all() and abs(np.linalg.det(corners[:, :3])) > 1e-3
    if not is_possible or np.abs(values - CHROMATICITIES["rec709"]).max() <= _ROUNDED:
        return None
    return tuple(float(value) for value in values)


def name_of(primaries: Chromaticities, gamma: float | None) -> str:
    """Return the name of a space of primaries and an exponent; None: with the sRGB curve."""
    known = {"Adobe RGB": ADOBE, **CHROMATICITIES}
    names = (name for name, one in known.items() if np.allclose(primaries, one, atol=_ROUNDED))
    name = next(names, "other primaries")
    if name == "Adobe RGB" and gamma is not None and abs(gamma - ADOBE_GAMMA) < 0.01:
        return name
    curve = "sRGB curve" if gamma is None else "linear" if gamma == 1 else f"gamma {gamma:.4g}"
    return f"{curve} with {name}"
