"""Colours for displays: other primaries, the curves PQ and HLG, and views of OpenColorIO."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.io.images import SPACES

__all__ = ["PRIMARIES", "TRANSFERS", "attributes", "check_primaries", "to_primaries", "viewed"]

_CONFIGURATION: Final = "ocio://default"
#: Linear spaces of the built-in configuration.
PRIMARIES: Final[Mapping[str, str]] = {
    "rec709": SPACES["linear"],
    "rec2020": "lin_rec2020_scene",
    "p3": "lin_p3d65_scene",
}
# Code points of Rec. ITU-T H.273.
_CICP_PRIMARIES: Final = {"rec709": 1, "rec2020": 9, "p3": 12}
#: The same for curves.
TRANSFERS: Final = {"linear": 8, "srgb": 13, "pq": 16, "hlg": 18}
# Red, green, blue, white, as x and y: Rec. ITU-R BT.709 and BT.2020, SMPTE EG 432-1.
_CHROMATICITIES: Final = {
    "rec709": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "rec2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    "p3": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
}
# Primaries and curve of the built-in displays; the others have no code points.
_DISPLAYS: Final[Mapping[str, tuple[int, int]]] = {
    "sRGB - Display": (1, 13),
    "Display P3 - Display": (12, 13),
    "Rec.1886 Rec.709 - Display": (1, 1),
    "Rec.2100-PQ - Display": (9, 16),
    "ST2084-P3-D65 - Display": (12, 16),
}
# OpenImageIO's names of the formats that can name colours by code points.
_WITH_CODE_POINTS: Final = ("png", "heif", "avif")


def check_primaries(primaries: str) -> None:
    """Raise ValueError for unknown primaries."""
    if primaries not in PRIMARIES:
        raise ValueError(f"primaries: {primaries!r} is not one of {', '.join(PRIMARIES)}")


def to_primaries(oiio: ModuleType, values: NDArray[Any], primaries: str) -> NDArray[Any]:
    """Convert the colours of linear Rec. 709 floats (H, W, 3 or 4) to other primaries."""
    if primaries == "rec709":
        return values
    source = oiio.ImageBuf(np.ascontiguousarray(values[:, :, :3], np.float32))
    made = oiio.ImageBufAlgo.colorconvert(
        source, PRIMARIES["rec709"], PRIMARIES[primaries], False, colorconfig=_CONFIGURATION
    )
    return _with_colours(values, made).astype(values.dtype)


def viewed(oiio: ModuleType, values: NDArray[Any], view: str) -> tuple[str, NDArray[np.float32]]:
    """Return the display of a view, and linear Rec. 709 floats as it shows them.

    `view`: "VIEW", of the first display that has it, or "DISPLAY/VIEW".
    """
    config = oiio.ColorConfig(_CONFIGURATION)
    named = [
        (shown, one) for shown in config.getDisplayNames() for one in config.getViewNames(shown)
    ]
    found = [pair for pair in named if view in (pair[1], "/".join(pair))]
    if not found:
        listed = ", ".join("/".join(pair) for pair in named)
        raise ValueError(f"view: {view!r} is not a view of OpenColorIO's configuration: {listed}")
    source = oiio.ImageBuf(np.ascontiguousarray(values[:, :, :3], np.float32))
    made = oiio.ImageBufAlgo.ociodisplay(
        source, *found[0], PRIMARIES["rec709"], "", False, colorconfig=_CONFIGURATION
    )
    return found[0][0], _with_colours(values, made)


def _with_colours(values: NDArray[Any], colours: Any) -> NDArray[np.float32]:
    if colours.has_error:
        raise ValueError(" ".join(colours.geterror().split()))
    made = values.astype(np.float32)
    made[:, :, :3] = colours.get_pixels()
    return made


def attributes(
    oiio: ModuleType, kind: str, target: Path, what: tuple[str, str] | str
) -> dict[str, tuple[Any, Any]]:
    """Return the attributes by which a file names its colours.

    - `kind`: OpenImageIO's name of the format.
    - `what`: Primaries and curve, or a display. ValueError: the format cannot name them.
    """
    if kind == "openexr" and not isinstance(what, str) and what[1] == "linear":
        return {"chromaticities": (oiio.TypeDesc("float[8]"), _CHROMATICITIES[what[0]])}
    if isinstance(what, str):
        points = _DISPLAYS.get(what)
    else:
        points = (_CICP_PRIMARIES[what[0]], TRANSFERS[what[1]]) if what[1] in TRANSFERS else None
    if kind in _WITH_CODE_POINTS:
        return {"CICP": (oiio.TypeDesc("int[4]"), (*points, 0, 1))} if points else {}
    if points in ((1, 13), (1, 8)):
        return {}
    name = what if isinstance(what, str) else " and ".join(what)
    raise ValueError(f"{target}: {kind} cannot name the colours {name}; write PNG or OpenEXR")
