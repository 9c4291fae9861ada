"""Find what files state of their colours and OpenImageIO does not report."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.containers import exif_of, png_chunks
from vkbloom._io.displayed import CHROMATICITIES
from vkbloom._io.images import SPACES, Chromaticities
from vkbloom._io.tiff import exif_fields

if TYPE_CHECKING:
    import OpenImageIO

# The largest four-byte integer of PNG.
_MAX_INTEGER: Final = 2**31 - 1
# A gAMA chunk holds the exponent of the encoding times this number; 0 is no exponent. A cHRM chunk
# holds coordinates in the same unit.
_PNG_SCALE: Final = 100_000
# Adobe RGB (1998), 4.3.1.1 and 4.3.4.2.
_ADOBE: Final = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
_ADOBE_GAMMA: Final = 563 / 256
# Tags of TIFF and Exif: directories, and what they say of colours.
_EXIF, _INTEROPERABILITY = 34665, 40965
_WHITE, _PRIMARIES = 318, 319
_COLOUR_SPACE, _GAMMA = 40961, 42240
_INDEX: Final = 1
# Exif's colour space: sRGB, uncalibrated, and some cameras' number of Adobe RGB.
_SRGB, _UNCALIBRATED, _ADOBE_RGB = 1, 65535, 2
# What DCF 2.0 calls its option file, which has Adobe RGB.
_OPTION_FILE: Final = b"R03"
_MAX_GAMMA: Final = 100
# Lines of a Radiance header.
_RADIANCE_LINE: Final = re.compile(rb"^(PRIMARIES|EXPOSURE|COLORCORR)=([^\n]*)$", re.MULTILINE)
_MAX_RADIANCE_HEADER: Final = 1 << 16
# How far coordinates may be off, as they are rounded.
_ROUNDED: Final = 2e-3


class Stated(NamedTuple):
    """What a file says of its colours.

    - `space`: OpenImageIO's name of the colour space; "" if there is none.
    - `gamma`: The exponent that decodes colours to light, if the file states one.
    - `primaries`: The chromaticities, if they are others than those of Rec. 709.
    - `said`: What the file says that is not used, in words.
    """

    space: str = ""
    gamma: float | None = None
    primaries: Chromaticities | None = None
    said: tuple[str, ...] = ()


def stated_colours(
    spec: OpenImageIO.ImageSpec, kind: str, path: str | os.PathLike[str], *, has_points: bool
) -> Stated:
    """Return what a file says of its colours.

    `kind`: OpenImageIO's name of the format. `has_points`: Whether the file has code points that
    are known.
    """
    space = spec.get_string_attribute("oiio:ColorSpace")
    gamma = spec.get_float_attribute("oiio:Gamma", 0.0) or None
    with open(path, "rb") as stream:
        match kind:
            case "hdr":
                return _of_radiance(stream, Stated(space, gamma))
            case "png":
                stated, is_stated = _of_png(stream)
                if stated.gamma is not None or has_points:
                    stated = stated._replace(space=space)
                if is_stated:
                    return stated
                stream.seek(0)
            case _:
                stated = Stated(space, gamma)
        exif = exif_of(stream, kind)
        return stated if exif is None else _of_exif(exif, stated)


def _of_png(stream: BinaryIO) -> tuple[Stated, bool]:
    """Return what chunks of a PNG file say, and whether they say something.

    OpenImageIO rounds the exponent to one decimal place, and takes an exponent of 0, which PNG does
    not allow, as linear.

    An sRGB chunk has precedence over gAMA and cHRM chunks (PNG, third edition, 4.3). Chunks that
    are damaged, or that follow the palette or the pixels, are ignored. Primaries without an
    exponent are ignored, as browsers do.
    """
    found: dict[bytes, bytes] = {}
    for kind, content in png_chunks(stream, (b"gAMA", b"cHRM", b"sRGB")):
        if kind in (b"PLTE", b"IDAT"):
            break
        if content is not None:
            found.setdefault(kind, content)
    if b"sRGB" in found:
        return Stated(SPACES["srgb"]), True
    value = int.from_bytes(found.get(b"gAMA", b""), "big")
    if len(found.get(b"gAMA", b"")) != 4 or not 0 < value <= _MAX_INTEGER:
        return Stated(SPACES["srgb"]), False
    # White is first in the file.
    stored = np.frombuffer(found.get(b"cHRM", b"").ljust(32, b"\0")[:32], ">u4")
    numbers = (np.roll(stored, -2) / _PNG_SCALE).tolist()
    return Stated(gamma=_PNG_SCALE / value, primaries=_others(numbers)), True


def _of_exif(exif: BinaryIO, stated: Stated) -> Stated:
    """Return what a file says that has Exif, or fields of TIFF, with which it begins."""
    own = exif_fields(exif, _COLOUR_SPACE, _GAMMA, pointers=(_EXIF,))
    space = own[_COLOUR_SPACE][0] if _COLOUR_SPACE in own else _UNCALIBRATED
    if space == _SRGB:
        return stated
    index = exif_fields(exif, _INDEX, pointers=(_EXIF, _INTEROPERABILITY)).get(_INDEX)
    if space == _ADOBE_RGB or (index is not None and index.tobytes()[:3] == _OPTION_FILE):
        return stated._replace(gamma=_ADOBE_GAMMA, primaries=_ADOBE)
    fields = exif_fields(exif, _WHITE, _PRIMARIES)
    primaries, white = _numbers(fields, _PRIMARIES, 6), _numbers(fields, _WHITE, 2)
    found = _others([*primaries, *(white or CHROMATICITIES["rec709"][6:])])
    if found is None:
        return stated
    gamma = (*_numbers(own, _GAMMA, 1), None)[0]
    return stated._replace(
        gamma=gamma if gamma is not None and gamma > 0 else None, primaries=found
    )


def _numbers(fields: Mapping[int, NDArray[Any]], tag: int, count: int) -> list[float]:
    """Return a field's numbers; []: it has others than expected."""
    values = fields.get(tag, np.empty(0))
    if values.size == 2 * count and values[1::2].all():
        # Fractions.
        values = values[::2] / values[1::2]
    return [float(value) for value in values] if values.size == count else []


def _of_radiance(stream: BinaryIO, stated: Stated) -> Stated:
    """Return what the lines of a Radiance header say, which end with an empty one."""
    header = stream.read(_MAX_RADIANCE_HEADER).replace(b"\r\n", b"\n").partition(b"\n\n")[0]
    said = []
    for name, words in _RADIANCE_LINE.findall(header):
        try:
            values = [float(word) for word in words.split()]
        except ValueError:
            continue
        if name == b"PRIMARIES":
            stated = stated._replace(primaries=_others(values))
        elif any(value != 1 for value in values):
            said.append(f"{name.decode()}={' '.join(f'{value:.4g}' for value in values)}")
    return stated._replace(said=tuple(said))


def _others(numbers: list[float]) -> Chromaticities | None:
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
    known = {"Adobe RGB": _ADOBE, **CHROMATICITIES}
    names = (name for name, one in known.items() if np.allclose(primaries, one, atol=_ROUNDED))
    name = next(names, "other primaries")
    if name == "Adobe RGB" and gamma is not None and abs(gamma - _ADOBE_GAMMA) < 0.01:
        return name
    curve = "sRGB curve" if gamma is None else "linear" if gamma == 1 else f"gamma {gamma:.4g}"
    return f"{curve} with {name}"
