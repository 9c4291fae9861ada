"""Decode pictures as they are stored to linear light with the primaries of Rec. 709.

sRGB, exponents and ICC profiles are computed here. Other colour spaces are those of OpenColorIO's
built-in configuration, which is in OpenImageIO, so that results do not depend on the machine's
configuration.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._io.alpha import divide
from vkbloom._io.attributes import without_colours
from vkbloom._io.chromaticities import CHROMATICITIES, name_of
from vkbloom._io.displayed import CONFIGURATION, PRIMARIES, between
from vkbloom._io.formats.tiff import LAB
from vkbloom._io.hdr_curves import DECODERS
from vkbloom._io.icc import from_chromaticities, from_lab, read_profile
from vkbloom._io.narrowing import narrow
from vkbloom._io.picture import (
    SPACES,
    Alpha,
    Chromaticities,
    CodePoints,
    Colour,
    Header,
    Picture,
    StatedColours,
    list_all,
)
from vkbloom._io.srgb import decode_srgb

# Spaces of an exponent. OpenColorIO's own powers are off by 2e-5.
_EXPONENTS: Final[Mapping[str, float]] = {SPACES["gamma22"]: 2.2, "g18_rec709_scene": 1.8}
# Spaces with the curves of code points.
_CURVES: Final[Mapping[str, str]] = {"gamma22": SPACES["gamma22"]}
# OpenImageIO's names of channels of which a file does not say what they are.
_UNNAMED: Final = re.compile(r"channel\d+\Z|\Z")
# OpenImageIO's name of the space of every PNM file.
_OF_PNM: Final = "Rec709"


def check_space(name: str) -> None:
    """Raise ValueError if the built-in configuration has no colour space of this name."""
    oiio = import_extra("OpenImageIO", "images", "Converting colours")
    config = oiio.ColorConfig(CONFIGURATION)
    if not config.resolve(name) or config.getColorSpaceIndex(name) < 0:
        raise ValueError(
            f"colour: {name!r} is not linear, srgb or a colour space of OpenColorIO's built-in "
            f"configuration: {', '.join(config.getColorSpaceNames())}"
        )


def decode(stored: Picture, colour: Colour | None = None) -> Picture:
    """Return a stored picture's red, green, blue and alpha as linear light, for a renderer.

    `colour`: A colour space instead of the one that the file states.
    """
    header = stored.header
    chosen, left_out = _choose_channels(header.channels)
    values = stored.pixels[:, :, chosen]
    kinds = {header.numbers[index] for index in chosen}
    numbers = kinds.pop() if len(kinds) == 1 else "float"
    if numbers == "half":
        # OpenImageIO reads all channels as float if one channel is float.
        values = values.astype(np.float16, copy=False)
    notes = [*stored.notes]
    if left_out:
        notes.append(f"left out the channels {list_all(left_out)}")
    if is_grey := len(chosen) < 3:
        values = values[:, :, [0, 0, 0, *range(1, len(chosen))]]
    is_encoded = values.dtype.kind == "u" or header.colours.is_encoded
    if is_encoded and values.shape[2] == 4 and header.alpha is Alpha.MULTIPLIED:
        values = _divide_by_alpha(values)
        header = replace(header, alpha=Alpha.STRAIGHT)
    is_other = colour not in (None, "linear", "srgb")
    exr = without_colours(header.exr_attributes) if is_other else header.exr_attributes
    taken_as, values, said = _linear(values, header, colour, is_encoded=is_encoded)
    # Attributes of the colours before the conversion are untrue now.
    attributes = {**header.attributes}
    profile = header.colours.profile or b""
    # OpenImageIO makes RGB of CMYK, whose profile stays that of CMYK.
    is_of_pixels = profile[16:20] in ((b"RGB ", b"GRAY") if is_grey else (b"RGB ",))
    if taken_as != "srgb" or not is_of_pixels:
        attributes.pop("ICCProfile", None)
    if is_other:
        attributes.pop("chromaticities", None)
    return Picture(
        pixels=np.ascontiguousarray(values),
        header=replace(header, attributes=attributes, exr_attributes=exr),
        encoding="linear",
        numbers=numbers,
        grey=is_grey,
        colour=taken_as,
        highlights=header.highlights(colour),
        parts=stored.parts,
        notes=(*notes, *said),
    )


def keep_profile(picture: Picture) -> Picture:
    """Return a decoded picture for a file of integers that gets the profile of its own file.

    Else the colours of a camera's profile, such as Display P3, that Rec. 709 has not would be
    clipped. Pictures that are sRGB or grey stay, as do those without such a profile of RGB.
    """
    stated = picture.header.colours
    if picture.grey or stated.profile is None or picture.colour != _profile_name(stated):
        return picture
    profile = read_profile(stated.profile)
    if not profile.is_invertible:
        return picture
    # That colours are converted is no news where they are converted back.
    notes = tuple(text for text in picture.notes if text != _note_of_profile(stated))
    return replace(picture, profile=profile, notes=notes)


def _profile_name(stated: StatedColours) -> str:
    """Return the colour space of a picture that was decoded by the file's profile."""
    return stated.profile_name or "ICC profile"


def _note_of_profile(stated: StatedColours) -> str:
    return f"converted to linear Rec. 709 by its ICC profile {stated.profile_name!r}"


def _choose_channels(names: tuple[str, ...]) -> tuple[list[int], list[str]]:
    """Return the indices of the colour and alpha channels, and the names of the other channels."""
    layers = dict.fromkeys(name.rpartition(".")[0] for name in names)
    # If all channels have the same layer, its name is not needed.
    plain = [name.rpartition(".")[2] if len(layers) == 1 else name for name in names]
    indices = {name.upper(): index for index, name in reversed(list(enumerate(plain)))}
    alpha = [indices[name] for name in ("A", "ALPHA") if name in indices][:1]
    if {"R", "G", "B"} <= indices.keys():
        chosen = [indices["R"], indices["G"], indices["B"], *alpha]
    elif len([name for name in names if name and not _UNNAMED.match(name)]) == 1 + len(alpha):
        grey = [index for index in range(len(names)) if index not in alpha]
        chosen = [min(grey, key=lambda index: bool(_UNNAMED.match(names[index]))), *alpha]
    elif len(layers) > 1:
        raise ValueError(
            f"the layers are {list_all(filter(None, layers))}; name one as the layer to read"
        )
    else:
        raise ValueError(
            f"the channels {list_all(names)} are not R, G, B or a single one, with or without alpha"
        )
    return chosen, [name for index, name in enumerate(names) if name and index not in chosen]


def _divide_by_alpha(values: NDArray[Any]) -> NDArray[Any]:
    """Return encoded colours divided by alpha; 16 bits hold the quotients of 8 bits."""
    if values.dtype.kind == "u":
        scale = 65535 // np.iinfo(values.dtype).max
        values = values.astype(np.uint16) * np.uint16(scale)
    return divide(values)


def _linear(
    values: NDArray[Any], header: Header, colour: Colour | None, *, is_encoded: bool
) -> tuple[str, NDArray[Any], list[str]]:
    """Return the assumed colour space, the linear floats, and notes; alpha is only scaled."""
    stated = header.colours
    if stated.space in LAB:
        made = _scale(values)
        made[:, :, :3] = from_lab(values[:, :, :3], stated.space)
        return stated.space, made, []
    if colour is not None:
        if colour not in ("linear", "srgb"):
            check_space(colour)
        return colour, _decode(values, colour), []
    if stated.has_gain_map:
        return _of_gain_map(values, stated)
    if stated.code_points is None:
        if stated.profile is not None and is_encoded:
            return _by_profile(values, stated, stated.profile)
        if stated.primaries is not None:
            return _by_primaries(values, header, stated.primaries, is_encoded=is_encoded)
    return _by_space(values, stated) if is_encoded else ("linear", values, _notes_of_floats(header))


def _by_profile(
    values: NDArray[Any], stated: StatedColours, content: bytes
) -> tuple[str, NDArray[Any], list[str]]:
    """As `_linear`, of an image of encoded colours with a profile."""
    try:
        profile = read_profile(content)
    except ValueError:
        space, made, _ = _by_space(values, stated)
        said = f"its ICC profile {stated.profile_name!r}"
        return space, made, [f"{said} is not one of RGB by a matrix and curves; taken as {space}"]
    if profile.is_srgb:
        return "srgb", _decode(values, "srgb"), []
    made = _scale(values)
    made[:, :, :3] = profile.decode(values[:, :, :3])
    return _profile_name(stated), made, [_note_of_profile(stated)]


def _of_gain_map(
    values: NDArray[Any], stated: StatedColours
) -> tuple[str, NDArray[Any], list[str]]:
    """As `_linear`, of linear floats with the primaries of a file's profile."""
    try:
        profile = read_profile(stated.profile or b"")
    except ValueError:
        return "linear", values, []
    if profile.is_srgb:
        return "linear", values, []
    made = values.astype(np.float32)
    made[:, :, :3] = made[:, :, :3] @ profile.matrix.T.astype(np.float32)
    said = "converted to linear Rec. 709 from the primaries of its ICC profile "
    return "linear", narrow(made, values.dtype), [f"{said}{stated.profile_name!r}"]


def _by_space(values: NDArray[Any], stated: StatedColours) -> tuple[str, NDArray[Any], list[str]]:
    """As `_linear`, of an image of encoded colours without a profile."""
    if stated.code_points is not None:
        return _by_code_points(values, stated, stated.code_points)
    if stated.gamma is not None:
        if stated.gamma == 1:
            return "linear", _decode(values, "linear"), []
        is_known = stated.space in _EXPONENTS
        space = stated.space if is_known else f"gamma {stated.gamma:.4g}"
        made = _decode(values, space, stated.gamma)
        return space, made, [f"the file says {space} of its colours; converted to linear Rec. 709"]
    # PNM's standard has the curve of BT.709. Programs write sRGB.
    named = "" if stated.space == _OF_PNM else stated.space
    space = {name: plain for plain, name in SPACES.items()}.get(named, named)
    if space in ("", "srgb", "linear"):
        return space or "srgb", _decode(values, space or "srgb"), []
    said = f"the file says {stated.space} of its colours"
    try:
        made = _decode(values, stated.space)
    except ValueError:
        return "srgb", _decode(values, "srgb"), [f"{said}, which is not known; taken as srgb"]
    return stated.space, made, [f"{said}; converted to linear Rec. 709"]


def _by_primaries(
    values: NDArray[Any], header: Header, primaries: Chromaticities, *, is_encoded: bool
) -> tuple[str, NDArray[Any], list[str]]:
    """As `_linear`, of chromaticities that a file states, with its exponent or the sRGB curve."""
    gamma = header.colours.gamma
    space = name_of(primaries, gamma if is_encoded else 1)
    curve = "srgb" if gamma is None else ""
    made = _decode(values, curve if is_encoded else "linear", gamma).astype(np.float32)
    made[:, :, :3] = made[:, :, :3] @ from_chromaticities(primaries).T.astype(np.float32)
    made = made.astype(values.dtype if values.dtype.kind == "f" else np.float32, copy=False)
    said = f"the file says {space} of its colours; converted to linear Rec. 709"
    return space, made, [said, *(() if is_encoded else _notes_of_floats(header))]


def _by_code_points(
    values: NDArray[Any], stated: StatedColours, points: CodePoints
) -> tuple[str, NDArray[Any], list[str]]:
    """As `_linear`. OpenImageIO takes several of these spaces as sRGB."""
    primaries, curve, is_narrow = points
    made = _decode(values, _CURVES.get(curve, curve), is_narrow=is_narrow)
    if primaries == "rec709" and curve in ("srgb", "linear"):
        return curve, made, []
    is_named = stated.space not in ("", SPACES["srgb"])
    space = stated.space if is_named else f"{curve}_{primaries}"
    said = f"the file says {space} of its colours; converted to linear Rec. 709"
    if primaries != "rec709":
        made = between(made, PRIMARIES[primaries], PRIMARIES["rec709"])
    return space, made.astype(np.float32, copy=False), [said]


def _notes_of_floats(header: Header) -> list[str]:
    """Return notes about the colour space of a file of floats, which is not converted."""
    notes: list[str] = []
    stated = header.colours
    if stated.space == SPACES["srgb"]:
        notes.append("the file says srgb of its colours, which as floats are taken as linear")
    elif stated.space not in ("", _OF_PNM, SPACES["linear"]):
        notes.append(f"the file says {stated.space} of its colours; values are taken as they are")
    _, primaries = header.attributes.get("chromaticities", (None, None))
    if primaries is not None and not np.allclose(primaries, CHROMATICITIES["rec709"], atol=2e-3):
        pairs = zip(*[iter(primaries)] * 2, strict=True)
        coordinates = ", ".join(f"{x:.4g} {y:.4g}" for x, y in pairs)
        notes.append(
            f"the file's chromaticities (red, green, blue, white: {coordinates}) are not those of "
            "Rec. 709; values are taken as they are"
        )
    return notes


def _decode(
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
            return narrow(made, values.dtype)
    made = _scale(values)
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


def _scale(values: NDArray[Any]) -> NDArray[Any]:
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
