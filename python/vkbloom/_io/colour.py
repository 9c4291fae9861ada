"""Convert colours of image files to linear Rec. 709.

sRGB, exponents and ICC profiles are computed here. Other colour spaces are those of OpenColorIO's
built-in configuration, which is in OpenImageIO, so that results do not depend on the machine's
configuration.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._io.displayed import (
    CHROMATICITIES,
    CONFIGURATION,
    between,
    from_primaries,
    of_code_points,
)
from vkbloom._io.hdr_curves import DECODERS
from vkbloom._io.icc import Profile, from_chromaticities, from_lab, read_profile
from vkbloom._io.images import SPACES, Chromaticities, Colour, StoredImage
from vkbloom._io.narrowing import narrowed
from vkbloom._io.srgb import decode_srgb
from vkbloom._io.stated_colours import name_of

# Spaces of an exponent. OpenColorIO's own powers are off by 2e-5.
_EXPONENTS: Final[Mapping[str, float]] = {SPACES["gamma22"]: 2.2, "g18_rec709_scene": 1.8}
# Spaces with the curves of code points.
_CURVES: Final[Mapping[str, str]] = {"gamma22": SPACES["gamma22"]}
#: Spaces of TIFF, whose numbers are not those of red, green and blue.
LAB: Final = ("CIELAB", "ICCLAB")
# OpenImageIO's name of the space of every PNM file.
_OF_PNM: Final = "Rec709"
# Half an 8-bit level, encoded. A profile that differs by less from sRGB counts as sRGB.
_SAME: Final = 0.5 / 255


def check_space(name: str) -> None:
    """Raise ValueError if the built-in configuration has no colour space of this name."""
    oiio = import_extra("OpenImageIO", "images", "Converting colours")
    config = oiio.ColorConfig(CONFIGURATION)
    if not config.resolve(name) or config.getColorSpaceIndex(name) < 0:
        raise ValueError(
            f"colour: {name!r} is not linear, srgb or a colour space of OpenColorIO's built-in "
            f"configuration: {', '.join(config.getColorSpaceNames())}"
        )


def linear(
    values: NDArray[Any], stored: StoredImage, colour: Colour | None
) -> tuple[str, NDArray[Any], list[str]]:
    """Return the assumed colour space, the linear floats, and notes; alpha is only scaled."""
    if stored.space in LAB:
        made = _scaled(values)
        made[:, :, :3] = from_lab(values[:, :, :3], stored.space)
        return stored.space, made, []
    if colour is not None:
        if colour not in ("linear", "srgb"):
            check_space(colour)
        return colour, _decoded(values, colour), []
    is_encoded = values.dtype.kind == "u" or stored.is_encoded
    if stored.is_ultra_hdr:
        return _of_ultra_hdr(values, stored)
    if stored.code_points is None:
        if stored.profile is not None and is_encoded:
            return _by_profile(values, stored, stored.profile)
        if stored.primaries is not None:
            return _by_primaries(values, stored, stored.primaries, is_encoded=is_encoded)
    return _by_space(values, stored) if is_encoded else ("linear", values, _notes_of_floats(stored))


def _by_profile(
    values: NDArray[Any], stored: StoredImage, content: bytes
) -> tuple[str, NDArray[Any], list[str]]:
    """As `linear`, of an image of encoded colours with a profile."""
    said = f"its ICC profile {stored.profile_name!r}"
    try:
        profile = read_profile(content)
    except ValueError:
        space, made, _ = _by_space(values, stored)
        return space, made, [f"{said} is not one of RGB by a matrix and curves; taken as {space}"]
    if _is_srgb(profile):
        return "srgb", _decoded(values, "srgb"), []
    made = _scaled(values)
    made[:, :, :3] = profile.decode(values[:, :, :3])
    name = stored.profile_name or "ICC profile"
    return name, made, [f"converted to linear Rec. 709 by {said}"]


def _of_ultra_hdr(values: NDArray[Any], stored: StoredImage) -> tuple[str, NDArray[Any], list[str]]:
    """As `linear`, of linear floats with the primaries of a file's profile."""
    try:
        profile = read_profile(stored.profile or b"")
    except ValueError:
        return "linear", values, []
    if _is_srgb(profile):
        return "linear", values, []
    made = values.astype(np.float32)
    made[:, :, :3] = made[:, :, :3] @ profile.matrix.T.astype(np.float32)
    said = "converted to linear Rec. 709 from the primaries of its ICC profile "
    return "linear", narrowed(made, values.dtype), [f"{said}{stored.profile_name!r}"]


def _by_space(values: NDArray[Any], stored: StoredImage) -> tuple[str, NDArray[Any], list[str]]:
    """As `linear`, of an image of encoded colours without a profile."""
    if stored.code_points is not None and (known := of_code_points(stored.code_points)):
        return _by_code_points(values, stored, *known)
    if stored.gamma is not None and stored.code_points is None:
        if stored.gamma == 1:
            return "linear", _decoded(values, "linear"), []
        is_known = stored.space in _EXPONENTS
        space = stored.space if is_known else f"gamma {stored.gamma:.4g}"
        made = _decoded(values, space, stored.gamma)
        return space, made, [f"the file says {space} of its colours; converted to linear Rec. 709"]
    # PNM's standard has the curve of BT.709. Programs write sRGB.
    stated = "" if stored.space == _OF_PNM else stored.space
    space = {name: plain for plain, name in SPACES.items()}.get(stated, stated)
    if space in ("", "srgb", "linear"):
        return space or "srgb", _decoded(values, space or "srgb"), []
    said = f"the file says {stored.space} of its colours"
    try:
        made = _decoded(values, stored.space)
    except ValueError:
        return "srgb", _decoded(values, "srgb"), [f"{said}, which is not known; taken as srgb"]
    return stored.space, made, [f"{said}; converted to linear Rec. 709"]


def _by_primaries(
    values: NDArray[Any], stored: StoredImage, primaries: Chromaticities, *, is_encoded: bool
) -> tuple[str, NDArray[Any], list[str]]:
    """As `linear`, of chromaticities that a file states, with its exponent or the sRGB curve."""
    space = name_of(primaries, stored.gamma if is_encoded else 1)
    curve = "srgb" if stored.gamma is None else ""
    made = _decoded(values, curve if is_encoded else "linear", stored.gamma).astype(np.float32)
    made[:, :, :3] = made[:, :, :3] @ from_chromaticities(primaries).T.astype(np.float32)
    made = made.astype(values.dtype if values.dtype.kind == "f" else np.float32, copy=False)
    said = f"the file says {space} of its colours; converted to linear Rec. 709"
    return space, made, [said, *(() if is_encoded else _notes_of_floats(stored))]


def _by_code_points(
    values: NDArray[Any], stored: StoredImage, primaries: str, curve: str
) -> tuple[str, NDArray[Any], list[str]]:
    """As `linear`. OpenImageIO takes several of these spaces as sRGB."""
    is_narrow = stored.code_points is not None and stored.code_points[3] == 0
    made = _decoded(values, _CURVES.get(curve, curve), is_narrow=is_narrow)
    if primaries == "rec709" and curve in ("srgb", "linear"):
        return curve, made, []
    is_named = stored.space not in ("", SPACES["srgb"])
    space = stored.space if is_named else f"{curve}_{primaries}"
    said = f"the file says {space} of its colours; converted to linear Rec. 709"
    return space, from_primaries(made, primaries), [said]


def _is_srgb(profile: Profile) -> bool:
    """Tell whether a profile means sRGB, within half a level of 8 bits."""
    levels = np.arange(0, 256, 51, dtype=np.uint8)
    probe = np.stack(np.meshgrid(levels, levels, levels), -1).reshape(6, 36, 3)
    plain = probe / 255
    expected = decode_srgb(plain)
    # Where the curve is flat, the same encoded difference is a smaller linear one.
    slope = np.maximum((decode_srgb(plain + 0.01) - expected) / 0.01, 1 / 12.92)
    return bool((np.abs(profile.decode(probe) - expected) <= _SAME * slope).all())


def _notes_of_floats(stored: StoredImage) -> list[str]:
    """Return notes about the colour space of a file of floats, which is not converted."""
    notes: list[str] = []
    if stored.space == SPACES["srgb"]:
        notes.append("the file says srgb of its colours, which as floats are taken as linear")
    elif stored.space not in ("", _OF_PNM, SPACES["linear"]):
        notes.append(f"the file says {stored.space} of its colours; values are taken as they are")
    _, primaries = stored.attributes.get("chromaticities", (None, None))
    if primaries is not None and not np.allclose(primaries, CHROMATICITIES["rec709"], atol=2e-3):
        listed = ", ".join(f"{x:.4g} {y:.4g}" for x, y in zip(*[iter(primaries)] * 2, strict=True))
        notes.append(
            f"the file's chromaticities (red, green, blue, white: {listed}) are not those of Rec. "
            "709; values are taken as they are"
        )
    return notes


def _decoded(
    values: NDArray[Any], space: str, exponent: float | None = None, *, is_narrow: bool = False
) -> NDArray[Any]:
    """Return linear floats from colours of a space; alpha is only scaled."""
    exponent = exponent or _EXPONENTS.get(space)
    if values.dtype.kind == "f":
        if space == "linear":
            return values
        made = values.astype(np.float32)
        with np.errstate(over="ignore"):
            made[:, :, :3] = _to_light(made[:, :, :3], space, exponent)
            return narrowed(made, values.dtype)
    made = _scaled(values)
    if space in ("srgb", *DECODERS) or exponent is not None or is_narrow:
        # A table with one entry per integer value, computed in float64.
        scale = np.iinfo(values.dtype).max
        levels = np.arange(scale + 1) / scale
        if is_narrow:
            step = (scale + 1) >> 8
            levels = np.clip((levels * scale - 16 * step) / (219 * step), 0, 1)
        table = _to_light(levels, space, exponent).astype(np.float32)
        made[:, :, :3] = table[values[:, :, :3]]
    elif space != "linear":
        made[:, :, :3] = _to_light(made[:, :, :3], space, None)
    return made


def _scaled(values: NDArray[Any]) -> NDArray[Any]:
    """Return integers as floats of 0..1; floats as they are."""
    if values.dtype.kind == "f":
        return values.copy()
    scale = np.iinfo(values.dtype).max
    made: NDArray[Any] = (np.arange(scale + 1) / scale).astype(np.float32)[values]
    return made


def _to_light(colours: NDArray[Any], space: str, exponent: float | None) -> NDArray[Any]:
    """Return linear colours from floats of a space."""
    if space == "linear":
        return colours
    if space == "srgb":
        return decode_srgb(colours)
    if space in DECODERS:
        # Floats may be negative.
        return DECODERS[space](np.maximum(colours, 0))
    if exponent is not None:
        # Negative values are not changed, as OpenColorIO has it.
        made: NDArray[Any] = np.where(colours > 0, np.maximum(colours, 0) ** exponent, colours)
        return made
    check_space(space)
    return between(colours, space, SPACES["linear"])
