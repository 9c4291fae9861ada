"""Colours for displays: other primaries, the curves PQ and HLG, and views of OpenColorIO."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._io.chromaticities import CHROMATICITIES
from vkbloom._io.expansion import KNEE, compress_peaks
from vkbloom._io.hdr_curves import ENCODERS, HDR_CURVES
from vkbloom._io.narrowing import narrow
from vkbloom._io.picture import SPACES, Attributes, CodePoints
from vkbloom._io.srgb import encode_srgb

#: OpenColorIO's built-in configuration.
CONFIGURATION: Final = "ocio://default"
#: Linear spaces of the built-in configuration.
PRIMARIES: Final[Mapping[str, str]] = {
    "rec709": SPACES["linear"],
    "rec2020": "lin_rec2020_scene",
    "p3": "lin_p3d65_scene",
}
# Of a view: the space of what it gets, no look, and colours that alpha does not divide.
_FROM_LINEAR: Final = (PRIMARIES["rec709"], "", False)
# Code points of Rec. ITU-T H.273, for primaries and for curves; 2 is an unknown curve.
_PRIMARY_POINTS: Final = {"rec709": 1, "rec2020": 9, "p3": 12}
_CURVE_POINTS: Final = {"none": 2, "gamma22": 4, "linear": 8, "srgb": 13, "pq": 16, "hlg": 18}
# Of files, in addition: the curve of Rec. ITU-R BT.709, which BT.601 and BT.2020 have, too.
_READ_CURVES: Final = {
    **{point: curve for curve, point in _CURVE_POINTS.items() if curve != "none"},
    **dict.fromkeys((1, 6, 14, 15), "rec709"),
}
# Curves that readers know or assume without code points.
_PLAIN: Final = ("linear", "srgb", "gamma22", "none")
# Curves whose values end at 1 in files of integers.
_ENDING_AT_1: Final = ("linear", "srgb", "gamma22", "rec709")
# Code points of the built-in displays; the others have none.
_DISPLAYS: Final[Mapping[str, tuple[int, int]]] = {
    "sRGB - Display": (1, 13),
    "Gamma 2.2 Rec.709 - Display": (1, 4),
    "Display P3 - Display": (12, 13),
    "Rec.1886 Rec.709 - Display": (1, 1),
    "Rec.2100-PQ - Display": (9, 16),
    "ST2084-P3-D65 - Display": (12, 16),
}


class Saved(NamedTuple):
    """What the colours of a file are to be.

    - `curve`: None: "srgb" for integers and "linear" for floats.
    - `view`: A view instead of a curve and primaries.
    """

    curve: str | None = None
    primaries: str = "rec709"
    view: str | None = None


def check_saved(saved: Saved) -> None:
    """Raise ValueError for primaries and views that do not exist or do not go together."""
    if saved.primaries not in PRIMARIES:
        raise ValueError(f"primaries: {saved.primaries!r} is not one of {', '.join(PRIMARIES)}")
    if saved.view is None:
        return
    if saved != Saved(view=saved.view):
        raise ValueError("view: it has its own encoding and primaries; leave them out")
    _display_of(import_extra("OpenImageIO", "images", "Views"), saved.view)


def is_hdr(saved: Saved) -> bool:
    """Whether a file is for HDR displays, and needs more than 8 bits."""
    if saved.view is None:
        return saved.curve in HDR_CURVES
    oiio = import_extra("OpenImageIO", "images", "Views")
    _, curve = _DISPLAYS.get(_display_of(oiio, saved.view)[0], (0, 0))
    return curve in (_CURVE_POINTS[name] for name in HDR_CURVES)


def convert(
    oiio: ModuleType,
    values: NDArray[Any],
    saved: Saved,
    curve: str,
    *,
    is_integer: bool,
    expand: float = 1.0,
) -> tuple[NDArray[Any], tuple[str, str] | str]:
    """Return linear Rec. 709 floats (H, W, C) as a file has them, and what they are then.

    `expand`: What the highlights of the picture were expanded up to.
    """
    if saved.view is not None:
        display, view = _display_of(oiio, saved.view)
        return _by_ocio(values, "ociodisplay", display, view, *_FROM_LINEAR), display
    if curve != "none" and saved.primaries != "rec709":
        ends = PRIMARIES["rec709"], PRIMARIES[saved.primaries]
        values = narrow(between(values, *ends), values.dtype)
    if is_integer and curve in _ENDING_AT_1:
        values = scale_to_1(values, expand=expand)
    return encode(values, curve), (saved.primaries, curve)


def scale_to_1(values: NDArray[Any], limit: float = 1.0, *, expand: float = 1.0) -> NDArray[Any]:
    """Return linear floats (H, W, C), in which no component of a colour is above the limit.

    Highlights that were expanded are compressed first. Else all of a sky that an expansion takes
    above 1 would be cut off there, and an outline would show where.

    A factor keeps the hue: Naik and Murthy, "Hue-preserving color image enhancement without gamut
    problem", IEEE Transactions on Image Processing 12(12), 2003. A clip of each component makes
    bright orange yellow, and cream white.
    """
    count = values.shape[2] - (values.shape[2] in (2, 4))
    peak = values[:, :, :count].max(axis=2, keepdims=True)
    is_over = np.isfinite(peak) & (peak > (limit if expand == 1 else KNEE))
    if not is_over.any():
        return values
    # (Half floats are divided as single ones, so that only the result is rounded, to levels.)
    made = values.astype(np.result_type(values.dtype, np.float32))
    one = made.dtype.type(1)
    peak = np.where(is_over, peak, one)
    wanted = np.minimum(compress_peaks(peak, expand), made.dtype.type(limit))
    made[:, :, :count] /= np.where(is_over, peak / wanted, one)
    return made


def encode(values: NDArray[Any], curve: str) -> NDArray[Any]:
    """Return linear floats (H, W, C) with their colours on a curve; alpha does not change."""
    if curve in ("none", "linear"):
        return values
    made = values.astype(np.float32)
    colours = made[:, :, : made.shape[2] - (made.shape[2] in (2, 4))]
    if curve == "srgb":
        colours[:] = encode_srgb(colours)
    elif curve in ENCODERS:
        colours[:] = ENCODERS[curve](colours)
    else:
        colours[:] = np.maximum(colours, 0) ** np.float32(1 / 2.2)
    return made


def with_names(
    oiio: ModuleType, attributes: Attributes, target: Path, what: tuple[str, str] | str
) -> tuple[bool, Attributes]:
    """Return attributes by which a file names its colours."""
    if isinstance(what, str):
        points, name, curve = _DISPLAYS.get(what), what, ""
    else:
        curve = what[1]
        points, name = (_PRIMARY_POINTS[what[0]], _CURVE_POINTS[curve]), " and ".join(what)
        if what[0] == "rec709" and curve in _PLAIN:
            return True, attributes
    writer = oiio.ImageOutput.create(f"image{target.suffix}")
    kind = writer.format_name()
    # A profile of the source would name other colours.
    kept = {name: value for name, value in attributes.items() if name != "ICCProfile"}
    if kind == "openexr" and curve in ("linear", "none"):
        numbers = oiio.TypeDesc("float[8]"), CHROMATICITIES[what[0]]
        return False, {**kept, "chromaticities": numbers}
    if points is None:
        known = ", ".join(_DISPLAYS)
        raise ValueError(f"view: files cannot name the colours of {name}; take one of {known}")
    if writer.supports("cicp"):
        named: dict[str, tuple[Any, Any]] = {"CICP": (oiio.TypeDesc("int[4]"), (*points, 0, 1))}
        if points != _DISPLAYS["sRGB - Display"]:
            # Without a space, OpenImageIO adds chunks of sRGB. It has no name for some spaces.
            named["oiio:ColorSpace"] = (oiio.TypeDesc("string"), "unknown")
        return False, {**kept, **named}
    if points == _DISPLAYS["sRGB - Display"]:
        return False, kept
    hint = "write PNG" if curve in ("", *HDR_CURVES) else "write PNG or OpenEXR"
    raise ValueError(f"{target}: {kind} cannot name the colours {name}; {hint}")


def code_points_of(points: Sequence[int], channels: int) -> CodePoints | None:
    """Return the names of a file's code points; None: one is not known."""
    # Grey has no primaries.
    point = points[0] if channels >= 3 else _PRIMARY_POINTS["rec709"]
    primaries = [name for name, known in _PRIMARY_POINTS.items() if known == point]
    curve = _READ_CURVES.get(points[1])
    return CodePoints(primaries[0], curve, points[3] == 0) if primaries and curve else None


@functools.cache
def _views(oiio: ModuleType) -> list[tuple[str, str]]:
    """Return all displays with their views; listing them takes 70 ms."""
    config = oiio.ColorConfig(CONFIGURATION)
    return [
        (shown, view) for shown in config.getDisplayNames() for view in config.getViewNames(shown)
    ]


def _display_of(oiio: ModuleType, view: str) -> tuple[str, str]:
    """Return display and view of "VIEW", of the first display that has it, or "DISPLAY/VIEW"."""
    for pair in _views(oiio):
        if view in (pair[1], "/".join(pair)):
            return pair
    listed = ", ".join("/".join(pair) for pair in _views(oiio))
    raise ValueError(f"view: {view!r} is not a view of OpenColorIO's configuration: {listed}")


def between(values: NDArray[Any], old: str, new: str) -> NDArray[np.float32]:
    """Return colours (H, W, 3 or 4), not clipped, of one space of OpenColorIO's in another."""
    return _by_ocio(values, "colorconvert", old, new, False)


def names_of_points(primaries: int, curve: int) -> tuple[str, str]:
    """Return the names of code points that are known."""
    known = {point: name for name, point in _PRIMARY_POINTS.items()}
    return known[primaries], _READ_CURVES[curve]


def points_of_names(primaries: str, curve: str) -> tuple[int, int]:
    """Return the code points of primaries and of a curve that files are written with."""
    return _PRIMARY_POINTS[primaries], _CURVE_POINTS[curve]


def _by_ocio(values: NDArray[Any], conversion: str, *how: Any) -> NDArray[np.float32]:
    """Return an image whose colours a conversion of OpenImageIO's has made; alpha as it is."""
    oiio = import_extra("OpenImageIO", "images", "Converting colours")
    colours = oiio.ImageBuf(np.ascontiguousarray(values[:, :, :3], np.float32))
    result = getattr(oiio.ImageBufAlgo, conversion)(colours, *how, colorconfig=CONFIGURATION)
    if result.has_error:
        raise ValueError(" ".join(result.geterror().split()))
    made = values.astype(np.float32)
    made[:, :, :3] = result.get_pixels()
    return made
