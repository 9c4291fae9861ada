"""Image files as arrays: `vkbloom.read` and `vkbloom.write`."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, Final, Literal, get_args, overload

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._extras import import_extra
from vkbloom._io import image_writing, safe_writing
from vkbloom._io.alpha import divide, hidden_notes, multiply
from vkbloom._io.displayed import Saved, check_saved
from vkbloom._io.expansion import check_expansion, expand_photograph
from vkbloom._io.image_file import read_picture
from vkbloom._io.narrowing import narrow
from vkbloom._io.picture import PIXEL_TYPES, Picture, SavedColour, check_pixels, is_exr
from vkbloom._io.readers import check_name
from vkbloom._numbers import check_index
from vkbloom._public import public
from vkbloom._version import installed_version

FileEncoding = Literal["none", SavedColour]

_ENCODINGS: Final = get_args(FileEncoding)
# Metadata that `read` adds about the file. The other entries are attributes, which can be written.
_FACTS: Final = ("numbers", "colour", "alpha", "parts", "notes")


@overload
def read(
    path: str | os.PathLike[str],
    *,
    layer: str | None = ...,
    subimage: int = ...,
    premultiplied: bool = ...,
    expand: float | None = ...,
    metadata: Literal[False] = ...,
) -> NDArray[Any]: ...
@overload
def read(
    path: str | os.PathLike[str],
    *,
    layer: str | None = ...,
    subimage: int = ...,
    premultiplied: bool = ...,
    expand: float | None = ...,
    metadata: Literal[True],
) -> tuple[NDArray[Any], dict[str, Any]]: ...
@public("vkbloom")
@check_arguments
def read(
    path: str | os.PathLike[str],
    *,
    layer: str | None = None,
    subimage: int = 0,
    premultiplied: bool = False,
    expand: float | None = None,
    metadata: bool = False,
) -> NDArray[Any] | tuple[NDArray[Any], dict[str, Any]]:
    """Read an image file as linear light, ready for `Renderer.apply`.

    Parameters
    ----------
    path : str or path-like
        A file of any format that OpenImageIO reads: PNG, JPEG, OpenEXR, Radiance HDR, TIFF and
        others.
    layer : str, optional
        The layer of an OpenEXR file, such as ``"ViewLayer.Combined"``: the channels ``layer.R``,
        ``layer.G`` and so on. Not needed for files with one layer.
    subimage : int, default 0
        The part of a file with several parts, from 0.
    premultiplied : bool, default False
        Whether to return colours multiplied by alpha. Some files have them multiplied, others not.
        By default multiplied ones are divided, except where alpha is 0. Flames and glows in OpenEXR
        files have colours with an alpha of 0: read them with ``premultiplied=True``.
    expand : float, optional
        What highlights of files of integers are expanded up to, 1 to 1024. A photograph has no
        values above 1: everything bright is clipped there. Expanded, its lights are brighter than
        its white walls, and can glow. None and 1: they stay as they are; so do files of floats.
        ``presets["photo"]`` is made for 4.
    metadata : bool, default False
        Whether to also return the file's metadata.

    Returns
    -------
    array : ndarray, shape (H, W, 3) or (H, W, 4)
        Top row first and upright; a grey image has three equal colours. Files of 8 and 16 bit
        integers become float32 of linear Rec. 709 colours. They are decoded as the file states (by
        a cICP chunk, an ICC profile, a gamma with or without primaries, or Exif), otherwise from
        sRGB. They are not clipped: colours outside of Rec. 709 have negative components. Half
        becomes float16 and float becomes float32, with unchanged values, but for the floats of JPEG
        XL, which are decoded, those of Radiance files with other primaries, and the scale of FITS.
    metadata : dict
        Only with ``metadata=True``. The file's attributes by OpenImageIO's names ("chromaticities",
        "XResolution", "Exif:LensModel", ...), which `write` accepts; "numbers" (the number type in
        the file, such as "uint8"), "colour" (the colour space from which colours were decoded),
        "alpha" ("straight", "premultiplied", or None without alpha), "parts" (the names of the
        parts) and "notes" (assumptions).

    Notes
    -----
    Profiles and colour spaces are converted with OpenColorIO's built-in configuration, which is
    part of OpenImageIO. Only profiles with a matrix and curves are used. With others (CMYK, grey,
    tables) the colours are decoded as sRGB, and "notes" says so. A cICP chunk with PQ gives 1 for
    203 cd/m2, and one with HLG gives 1 for the signal 0.75, as `write` has it; such files are not
    expanded.

    `expand` maps m = max(r, g, b) above the knee a = 0.8 to a + (m - a) / (1 - k (m - a)), with
    k = 1 / (1 - a) - 1 / (expand - a), and multiplies the colour by the ratio. Up to 0.8 (the level
    231 of 255 in sRGB) nothing changes, and 1 becomes `expand`.
    """
    check_name(path)
    subimage = check_index("subimage", subimage, -(2**31), 2**31 - 1)
    check_expansion(expand)
    picture = expand_photograph(read_picture(path, subimage, layer), expand)
    pixels = picture.pixels
    has_alpha = pixels.shape[2] == 4
    if has_alpha and picture.is_multiplied is not premultiplied:
        pixels = multiply(pixels) if premultiplied else divide(pixels)
    if not metadata:
        return pixels
    facts: dict[str, Any] = {
        name: _plain(value) for name, (_, value) in picture.header.attributes.items()
    }
    facts.update(
        numbers=picture.numbers,
        colour=picture.colour,
        alpha=("premultiplied" if premultiplied else "straight") if has_alpha else None,
        parts=picture.parts,
        notes=(*picture.notes, *(() if premultiplied else hidden_notes(picture))),
    )
    return pixels, facts


def _check_conversions(values: NDArray[Any], saved: Saved, bits: int | None) -> None:
    """Raise ValueError for conversions of `write` that the values cannot have."""
    is_float, encoding = values.dtype.kind == "f", saved.curve
    if encoding is not None and (encoding not in _ENCODINGS or not is_float):
        raise ValueError(
            f"encoding: {encoding!r} is not one of {', '.join(_ENCODINGS)}"
            if is_float
            else f"encoding: {encoding!r} needs floats; {values.dtype} is written unchanged"
        )
    if bits is not None and (bits not in image_writing.BITS or not is_float):
        size = 8 * values.dtype.itemsize
        if bits != size or is_float:
            raise ValueError(f"bits: {bits!r} is not one of {'8, 16, 32' if is_float else size}")
    check_saved(saved)
    needs_three = saved.view is not None or saved.primaries != "rec709"
    if needs_three and (not is_float or values.shape[2] < 3):
        raise ValueError("array: primaries and views need linear floats of RGB or RGBA")


@public("vkbloom")
@check_arguments
def write(
    path: str | os.PathLike[str],
    array: NDArray[Any],
    *,
    encoding: FileEncoding | None = None,
    bits: int | None = None,
    quality: int | None = None,
    premultiplied: bool = False,
    primaries: str = "rec709",
    view: str | None = None,
    expand: float | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Path:
    """Write an array to an image file.

    Parameters
    ----------
    path : str or path-like
        A file name with an extension that OpenImageIO writes. The file is first written under
        another name. An existing file is replaced when the new one is complete.
    array : ndarray, shape (H, W), (H, W, 1), (H, W, 2), (H, W, 3) or (H, W, 4)
        Grey, grey with alpha, RGB or RGBA. uint8 and uint16 are written unchanged. Floats are
        linear light: encoded in files of integers (PNG, JPEG, ...), unchanged in files of floats
        (OpenEXR, Radiance HDR, TIFF). Files of integers end at 1: colours with a component above 1
        are divided by their largest component, which keeps their hue; negative ones become 0.
    encoding : {"srgb", "gamma22", "linear", "pq", "hlg", "none"}, optional
        The curve of the file's colours, for floats. Default: "srgb" for files of integers and
        "linear" for files of floats. "pq" and "hlg" are those of Rec. ITU-R BT.2100, with 203
        cd/m2 for a value of 1, as in `Settings`. "none": the values are encoded already, such as
        those of a `final` with an `encoding`.
    bits : {8, 16, 32}, optional
        Size of a number in the file, for floats. Default: 8 in files of integers, and that of the
        array's dtype in files of floats.
    quality : int, optional
        Quality of JPEG, WebP and JPEG XL, 1 to 100. Colours are not subsampled, unless the metadata
        contain a subsampling.
    premultiplied : bool, default False
        Whether the array's colours are multiplied by alpha. OpenEXR files have multiplied colours,
        other formats straight ones. Colours are converted if needed.
    primaries : {"rec709", "rec2020", "p3"}
        Primaries of the file. Linear floats of Rec. 709 are converted to them by OpenColorIO; with
        the encoding "none" they only name the colours. PNG has them in a cICP chunk, OpenEXR as
        chromaticities; other formats are refused.
    view : str, optional
        A view of OpenColorIO's built-in configuration, such as "ACES 2.0 - SDR 100 nits
        (Rec.709)", of the first display that has it, or "DISPLAY/VIEW". It replaces `encoding`
        and `primaries`, and needs linear floats and a file of integers. The error for an unknown
        one lists all.
    expand : float, optional
        What `read` expanded the highlights up to, 1 to 1024. Files of integers for SDR get them
        compressed by the inverse, so that a bright sky keeps its clouds; without it, all above 1 is
        cut off. Not for a `final` with a `tonemap` or an `encoding`.
    metadata : mapping of str to object, optional
        Metadata from `read`, or attributes by OpenImageIO's names: text, numbers, or sequences of
        them.

    Returns
    -------
    Path
        The file.

    Notes
    -----
    `read` returns colours with the primaries of Rec. 709. A Display P3 photograph that is read and
    written as PNG keeps its colours with ``primaries="p3"``; without it, colours outside of Rec.
    709 are clipped. OpenEXR keeps them as negative components. "pq" and "hlg" need 16 bits to show
    no bands.

    Finite values beyond the range of the file's floats become its largest number: 65504 with 16
    bits, 1.69e38 in Radiance HDR, where infinity becomes this number, too, and NaN and negative
    values become 0. In files of integers NaN becomes 0 and infinity 1. A UserWarning says so, but
    not of negative values.
    """
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    target = Path(check_name(path))
    given = _check(array)
    # No format has more than 32 bits.
    values = narrow(given, np.dtype(np.float32)) if given.dtype.name == "float64" else given
    is_float = values.dtype.kind == "f"
    compressed = check_expansion(expand)
    saved = Saved(encoding, primaries, view)
    _check_conversions(values, saved, bits)
    safe_writing.writer_of(target)
    if values.shape[2] in (2, 4) and premultiplied is not is_exr(target):
        values = divide(values) if premultiplied else multiply(values)
    numbers = PIXEL_TYPES[values.dtype.name]
    encoded: SavedColour | None = "linear" if is_float else None
    picture = Picture.of_values(values, numbers, encoded, _add_types(oiio, metadata or {}))
    picture = replace(picture, expand=compressed)
    bits = bits if is_float else None
    # (Of 32 bits, `chosen_layout` says that the format has no floats.)
    image_writing.check_options(target, saved, quality, None if bits == 32 else bits)
    layout = image_writing.choose_layout(picture, target, is_hdr=False, bits=bits)
    if (channels := layout[0].shape[2]) != values.shape[2]:
        raise ValueError(f"{target}: its format has no alpha; write array[..., :{channels}]")
    if not is_float and layout[1] != numbers:
        raise ValueError(
            f"{target}: its format holds {layout[1]}, not {numbers}; write linear floats, as "
            "vkbloom.read gives them"
        )
    # (Such files may be replaced by the command `apply`.)
    program = {"Software": f"{safe_writing.PROGRAM} {installed_version()}"}
    if "Software" in (metadata or {}):
        program = {}
    image_writing.save(picture, target, saved, program, quality, layout=layout)
    if (text := image_writing.number_note(given, layout, target)) is not None:
        warnings.warn(text, UserWarning, stacklevel=3)
    return target


def _check(array: NDArray[Any]) -> NDArray[Any]:
    """Return the array as (H, W, C), after a check of its shape and dtype."""
    try:
        values = np.asanyarray(array)
    except (TypeError, ValueError) as error:
        raise TypeError(f"array: an array is needed; NumPy: {error}") from None
    values = check_pixels("array", values)
    if values.shape[2] > 4:
        raise ValueError(f"array: {values.shape[2]} channels are not 1 to 4")
    return values


def _plain(value: Any) -> Any:
    """Return an attribute's value as a str, a number, bytes or a tuple of numbers."""
    if isinstance(value, np.ndarray):
        return value.tobytes() if value.dtype == np.uint8 else tuple(value.tolist())
    return value


def _add_types(oiio: ModuleType, metadata: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Return attributes with OpenImageIO's types."""
    typed: dict[str, tuple[Any, Any]] = {}
    for name, value in metadata.items():
        if name in _FACTS:
            continue
        match value:
            case str():
                typed[name] = oiio.TypeDesc("string"), value
            case bytes():
                array = np.frombuffer(value, np.uint8)
                typed[name] = oiio.TypeDesc(f"uint8[{len(array)}]"), array
            case int() | np.integer():
                typed[name] = oiio.TypeDesc("int"), int(value)
            case float() | np.floating():
                typed[name] = oiio.TypeDesc("float"), float(value)
            case tuple() | list() | np.ndarray():
                numbers = np.asarray(value)
                if numbers.ndim != 1 or numbers.dtype.kind not in "iuf" or not numbers.size:
                    raise TypeError(f"metadata: {name!r} is {value!r}, neither text nor numbers")
                kind = "float" if numbers.dtype.kind == "f" else "int"
                typed[name] = oiio.TypeDesc(f"{kind}[{numbers.size}]"), tuple(numbers.tolist())
            case _:
                raise TypeError(f"metadata: {name!r} is {value!r}, neither text nor numbers")
    return typed
