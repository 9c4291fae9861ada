"""Write pictures to image files, converted to a number type and channels of the format."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import native_order
from vkbloom._c_paths import for_c
from vkbloom._extras import import_extra
from vkbloom._io import displayed, safe_writing
from vkbloom._io.attributes import without_colours, write_exr_attributes
from vkbloom._io.displayed import Saved
from vkbloom._io.icc import Profile
from vkbloom._io.narrowing import file_note, for_radiance, narrow
from vkbloom._io.picture import DTYPES, PIXEL_TYPES, SPACES, WITH_WINDOWS, Picture, is_exr
from vkbloom._numbers import check_index

if TYPE_CHECKING:
    import OpenImageIO

# Number types to write, in order of preference, by the number type of the picture. For floats
# uint8 comes before uint16, because a PNG of a float picture is expected to have 8 bits.
_PREFERENCES: Final[Mapping[str, tuple[str, ...]]] = {
    "uint8": ("uint8", "float", "half", "uint16"),
    "uint16": ("uint16", "float", "half", "uint8"),
    "half": ("half", "float", "uint8", "uint16"),
    "float": ("float", "half", "uint8", "uint16"),
    "double": ("float", "half", "uint8", "uint16"),
}
# Those of files that hold linear light.
_FLOATS: Final = ("half", "float", "double")
# What HDR curves need, whatever the picture has.
_DEEP: Final = ("uint16", "half", "float", "uint8")
#: Number types to write, in order of preference, by the size of a number.
BITS: Final[Mapping[int | None, tuple[str, ...]]] = {
    8: ("uint8",),
    16: ("uint16", "half"),
    32: ("float",),
}
# OpenImageIO's names of the formats that have a quality, 1 to 100.
_LOSSY: Final = ("jpeg", "webp", "jpegxl")
# Those with profiles that readers use. (OpenEXR's values are linear, whatever a profile says.)
_WITH_PROFILES: Final = ("jpeg", "png", "tiff", "webp", "jpegxl", "jpeg2000")


#: The values to write, with the file's channels, and the file's number type.
Layout = tuple[NDArray[Any], str]


class Part(NamedTuple):
    """Values to write unchanged, shape (H, W, C) with 1 to 4 channels, and what describes them."""

    values: NDArray[Any]
    picture: Picture
    attributes: Mapping[str, str | int]


def check_options(
    path: str | os.PathLike[str], saved: Saved, quality: int | None, bits: int | None = None
) -> None:
    """Raise ValueError for a file that cannot be written, or not as these options say."""
    kind = safe_writing.writer_of(path).format_name()
    displayed.check_saved(saved)
    if quality is not None:
        check_index("quality", quality, 1, 100)
        if kind not in _LOSSY:
            raise ValueError(f"quality: {kind} has no quality; {', '.join(_LOSSY)} have one")
    if bits is not None:
        suffix = Path(path).suffix
        if not any(safe_writing.holds(suffix, 3, numbers) for numbers in BITS.get(bits, ())):
            raise ValueError(f"bits: {kind} has no numbers of {bits} bits; write another format")


def is_straight(path: str | os.PathLike[str], *, is_multiplied: bool) -> bool:
    """Return whether readers of a file expect alpha, and colours that are not multiplied by it."""
    file = Path(path)
    if is_exr(file) or (is_multiplied and file.suffix.lower() in (".tif", ".tiff")):
        return False
    return bool(safe_writing.writer_of(file).supports("alpha"))


def save(
    picture: Picture,
    path: str | os.PathLike[str],
    saved: Saved | None = None,
    attributes: Mapping[str, str] | None = None,
    quality: int | None = None,
    *,
    bits: int | None = None,
    layout: Layout | None = None,
) -> tuple[str, ...]:
    """Write a picture to a file, with its own number type or the closest one of the format.

    Grey pictures are written with one channel if the format supports it, else as RGB. Data and
    display windows are kept in OpenEXR, else pixels outside the display window are cut
    off. Integer files cover 0..1: NaN becomes 0 and infinity becomes 1. Alpha is not changed.
    """
    saved = saved or Saved()
    if saved != Saved() and picture.encoding != "linear":
        raise ValueError(
            f"colour: {saved.view or saved.curve or saved.primaries!r} needs a linear picture; "
            f"this one is {picture.encoding}"
        )
    check_options(path, saved, quality)
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    target = Path(path)
    added = {} if quality is None else {"CompressionQuality": quality}
    if saved.view is not None or saved.primaries != "rec709":
        picture = dataclasses.replace(picture, grey=False)
    if layout is None:
        layout = choose_layout(picture, target, is_hdr=displayed.is_hdr(saved), bits=bits)
    values, described, notes = _prepare(oiio, picture, layout, saved, target)
    part = Part(values, described, {**(attributes or {}), **added})
    with safe_writing.replacing(oiio, {target: values.nbytes}) as (temporary,):
        put(oiio, [part], temporary, target)
    return notes


def levels_of(final: NDArray[Any], encoding: str, expand: float) -> NDArray[np.uint8]:
    """Return the levels that `save` writes of a `final` to an sRGB file of 8 bits."""
    if encoding == "none" and final.dtype.kind == "f":
        final = displayed.encode(displayed.scale_to_1(final, expand=expand), "srgb")
    return _as_numbers(final, "uint8")


def _prepare(
    oiio: ModuleType, picture: Picture, layout: Layout, saved: Saved, target: Path
) -> tuple[NDArray[Any], Picture, tuple[str, ...]]:
    """Return the values to write in a layout, what describes them, and notes about losses."""
    values, numbers = layout
    integer = numbers.startswith("uint")
    notes = _losses(picture, target, layout)
    if picture.encoding is None:
        return _as_numbers(values, numbers), picture, tuple(notes)
    what: tuple[str, str] | str = ("rec709", picture.encoding)
    is_shown = saved.view is not None or displayed.is_hdr(saved)
    if picture.encoding == "linear":
        if integer and not is_shown and picture.numbers in _FLOATS and _is_above_1(picture.pixels):
            notes.append(
                f"{target} has integers: values above 1 are clipped; --tonemap aces or --view "
                "keeps them apart"
            )
        if saved.view is not None and not integer:
            raise ValueError(f"view: {target} has linear floats; write a file of integers")
        if integer and saved == Saved() and picture.profile is not None:
            made = _by_profile(values, picture, picture.profile)
            return _as_numbers(made, numbers), _with_profile(oiio, picture), tuple(notes)
        curve = saved.curve or ("srgb" if integer else "linear")
        values, what = displayed.convert(
            oiio, values, saved, curve, is_integer=integer, expand=picture.expand
        )
    try:
        described = describe_as(oiio, picture, target, what)
    except ValueError as error:
        if picture.encoding == "linear":
            raise
        # The settings made these colours, not the file's options.
        described = dataclasses.replace(picture, encoding=None)
        notes.append(str(error))
    return _as_numbers(values, numbers), described, tuple(notes)


def holds_profile(path: str | os.PathLike[str]) -> bool:
    """Return whether files with this name hold an ICC profile that describes integers."""
    return safe_writing.writer_of(path).format_name() in _WITH_PROFILES


def _by_profile(values: NDArray[Any], picture: Picture, profile: Profile) -> NDArray[np.float32]:
    """Return linear Rec. 709 floats (H, W, 3 or 4) as the profile has them; alpha as it is."""
    made = values.astype(np.float32)
    light = profile.from_rec_709(made[:, :, :3])
    made[:, :, :3] = profile.encode(displayed.scale_to_1(light, expand=picture.expand))
    return made


def _with_profile(oiio: ModuleType, picture: Picture) -> Picture:
    """Return a picture whose attributes have the profile of its file, which names its colours."""
    header = picture.header
    content = np.frombuffer(header.colours.profile or b"", np.uint8)
    named = {
        "ICCProfile": (oiio.TypeDesc(f"uint8[{content.size}]"), content),
        # Else OpenImageIO writes that a PNG file is sRGB.
        "oiio:ColorSpace": (oiio.TypeDesc("string"), "unknown"),
    }
    header = dataclasses.replace(
        header,
        attributes={**header.attributes, **named},
        colours=header.colours._replace(space=""),
    )
    return dataclasses.replace(picture, encoding=None, header=header)


def _is_above_1(pixels: NDArray[Any]) -> bool:
    """Whether colours are above 1, also after the rounding of half floats."""
    colours = pixels[:, :, :3]
    return bool((colours[np.isfinite(colours)] > 1.001).any())


def describe_as(
    oiio: ModuleType, picture: Picture, target: Path, what: tuple[str, str] | str
) -> Picture:
    """Return a picture whose attributes name colours; `what` as for `displayed.with_names`."""
    is_plain, attributes = displayed.with_names(oiio, picture.header.attributes, target, what)
    exr = picture.header.exr_attributes
    exr = exr if is_plain else without_colours(exr)
    header = dataclasses.replace(picture.header, attributes=attributes, exr_attributes=exr)
    if is_plain:
        curve: Any = None if what[1] == "none" else what[1]
        return dataclasses.replace(picture, encoding=curve, header=header)
    colours = header.colours._replace(space="")
    header = dataclasses.replace(header, colours=colours)
    return dataclasses.replace(picture, encoding=None, header=header)


def put(oiio: ModuleType, parts: Sequence[Part], temporary: Path, target: Path) -> None:
    """Write the parts of a file to its temporary file; only OpenEXR has more than one."""
    writer = oiio.ImageOutput.create(temporary.name)
    if writer.format_name() not in WITH_WINDOWS:
        parts = [part._replace(values=_crop_to_display(part)) for part in parts]
    if writer.format_name() == "hdr":
        parts = [part._replace(values=for_radiance(part.values)) for part in parts]
    specs = [_spec_of(oiio, writer, part, target) for part in parts]
    is_written = True
    with for_c(temporary) as name:
        for index, (part, spec) in enumerate(zip(parts, specs, strict=True)):
            mode = ("AppendSubimage",) if index else ()
            opened = specs if len(specs) > 1 and not index else spec
            is_written = (
                is_written
                and writer.open(name, opened, *mode)
                and writer.write_image(np.ascontiguousarray(native_order(part.values)))
            )
        is_written = is_written and writer.close()
    # JPEG 2000's writer says that pictures of under 32 pixels on a side are written.
    is_written = is_written and not (writer.format_name() == "jpeg2000" and writer.has_error)
    if not is_written:
        raise safe_writing.write_error(writer, temporary, target)
    # Clear the error: OpenImageIO prints an unread one when the writer is destroyed.
    writer.geterror()


def _crop_to_display(part: Part) -> NDArray[Any]:
    """Return the values inside the display window."""
    header = part.picture.header
    x, y, width, height = header.display
    row, column = y - header.origin[1], x - header.origin[0]
    return part.values[row : row + height, column : column + width]


def _spec_of(
    oiio: ModuleType, writer: OpenImageIO.ImageOutput, part: Part, target: Path
) -> OpenImageIO.ImageSpec:
    """Return OpenImageIO's description of a part."""
    header = part.picture.header
    height, width, channels = part.values.shape
    spec: OpenImageIO.ImageSpec = oiio.ImageSpec(
        width, height, channels, PIXEL_TYPES[part.values.dtype.name]
    )
    if header.channels == ("Z",):
        spec.channelnames = header.channels
        spec.z_channel = 0
    elif channels < 3:
        has_alpha = channels == 2
        spec.channelnames = ("Y", "A")[:channels]
        spec.alpha_channel = 1 if has_alpha else -1
    if writer.format_name() in WITH_WINDOWS:
        spec.x, spec.y = header.origin
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = header.display
    _describe(spec, part.picture, writer.format_name(), target)
    for name, value in part.attributes.items():
        spec.attribute(name, value)
    return spec


def choose_layout(picture: Picture, target: Path, *, is_hdr: bool, bits: int | None) -> Layout:
    """Return the closest channels and number type that the format supports."""
    wanted = _DEEP if is_hdr else _PREFERENCES[picture.numbers]
    if bits is not None:
        wanted = BITS[bits]
    writer = safe_writing.writer_of(target)
    for values in _layouts(picture, safe_writing.has_alpha(writer)):
        for numbers in wanted:
            if safe_writing.holds(target.suffix, values.shape[2], numbers):
                return values, numbers
    raise ValueError(
        f"{target}: {writer.format_name()} cannot hold {picture.pixels.shape[2]} channels of "
        f"{' or '.join(wanted)}; use another format, or other channels"
    )


def _layouts(picture: Picture, with_alpha: bool) -> Iterator[NDArray[Any]]:
    layouts = [picture.values, picture.pixels] if picture.grey else [picture.pixels]
    if with_alpha:
        yield from layouts
    if picture.pixels.shape[2] == 4:
        yield from (layout[:, :, :-1] for layout in layouts)
    elif not with_alpha:
        yield from layouts


def _losses(picture: Picture, target: Path, layout: Layout) -> list[str]:
    """Return notes about information that the file loses or that readers interpret differently."""
    notes: list[str] = []
    values = layout[0]
    is_float, has_alpha = values.dtype.kind == "f", values.shape[2] in (2, 4)
    if picture.pixels.shape[2] == 4:
        opaque = 1.0 if is_float else np.iinfo(values.dtype).max
        is_opaque = bool((picture.pixels[:, :, 3] == opaque).all())
        suffix = target.suffix.lower()
        # A TIFF file records which of the two it has.
        associated = (suffix == ".exr") if suffix not in (".tif", ".tiff") else None
        if not has_alpha and not is_opaque:
            notes.append(f"{target} cannot hold alpha, which is not 1 everywhere")
        elif has_alpha and not is_opaque and associated is (not picture.is_multiplied):
            notes.append(
                f"colours and alpha are written to {target} unchanged, but its readers expect "
                f"colours {'' if associated else 'not '}multiplied by alpha"
            )
    if (text := number_note(values, layout, target)) is not None:
        notes.append(text)
    return notes


def number_note(values: NDArray[Any], layout: Layout, target: Path) -> str | None:
    """Return a note about numbers that a file in a layout cannot hold, or None."""
    text = file_note(values, DTYPES[layout[1]], safe_writing.writer_of(target).format_name())
    return None if text is None else f"{target} {text}"


def _as_numbers(values: NDArray[Any], numbers: str) -> NDArray[Any]:
    """Return values as numbers of a file; for integers 1 becomes the largest value."""
    dtype = DTYPES[numbers]
    if values.dtype.kind == "u":
        if values.dtype == dtype:
            return values
        values = values / np.float32(np.iinfo(values.dtype).max)
    if dtype.kind == "f":
        return narrow(values, dtype)
    clipped = np.clip(np.nan_to_num(values.astype(np.float32), nan=0.0), 0.0, 1.0)
    integers: NDArray[Any] = np.rint(clipped * np.float32(np.iinfo(dtype).max)).astype(dtype)
    return integers


def _describe(
    spec: OpenImageIO.ImageSpec, picture: Picture, format_name: str, target: Path
) -> None:
    """Set the attributes that describe a file's colours, alpha and pixels."""
    to_exr = is_exr(target)
    header, encoding = picture.header, picture.encoding
    # OpenImageIO has no names for PQ and HLG with the primaries of Rec. 709.
    space = header.colours.space if encoding is None else SPACES.get(encoding, "")
    # OpenEXR files are linear by definition, and another attribute has their primaries.
    if space and not (to_exr and encoding == "linear"):
        spec.attribute("oiio:ColorSpace", space)
    # Otherwise OpenImageIO divides by alpha for formats with straight colours. TIFF can record
    # either.
    is_tiff = target.suffix.lower() in (".tif", ".tiff")
    if not to_exr and not (is_tiff and picture.is_multiplied):
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if to_exr:
        write_exr_attributes(spec, header.exr_attributes)
    is_jpeg = format_name == "jpeg"
    if is_jpeg and spec.nchannels == 3:
        # No subsampling of colours, unless the picture's attributes contain one.
        spec.attribute("jpeg:subsampling", "4:4:4")
    for name, (kind, value) in header.attributes.items():
        # A profile describes encoded colours, not those of a picture that was written linear.
        if name == "ICCProfile" and encoding not in ("srgb", None):
            continue
        if name.startswith("jpeg:") and not is_jpeg:
            continue
        if isinstance(value, int):
            # OpenImageIO's Python module sets integers of 32 bits; Exif has 16 (ISO, flash).
            spec.attribute(name, value)
        else:
            spec.attribute(name, kind, value)
