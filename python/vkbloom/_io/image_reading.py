"""Read image files, and decode them to the linear values that bloom is computed from."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._c_paths import for_c
from vkbloom._extras import import_extra
from vkbloom._io.alpha import Meaning, channels_of, divided, light_of, meaning_of
from vkbloom._io.colour import LAB, linear
from vkbloom._io.containers import HEIF_ADVICE, fits_scale, is_heif, orientation_of, upright
from vkbloom._io.displayed import has_hdr_curve, of_code_points
from vkbloom._io.expansion import expanded
from vkbloom._io.exr_attributes import own_attributes, without_colours
from vkbloom._io.images import (
    DTYPES,
    PIXEL_TYPES,
    WITH_WINDOWS,
    Colour,
    Highlights,
    Picture,
    StoredImage,
    Window,
    check_name,
    complete,
    failure_of,
    is_kept,
    listed,
    warnings_of,
)
from vkbloom._io.jpeg_xl import header_of
from vkbloom._io.readable_copies import readable
from vkbloom._io.stated_colours import stated_colours
from vkbloom._io.stored_values import SIGNED, corrected, scale_of, without_white
from vkbloom._io.tiff import RAW_ADVICE, is_raw, reduced_parts

if TYPE_CHECKING:
    import OpenImageIO

_LARGEST_SIDE: Final = 65536
# Pixels of the largest texture, 16384 x 16384. A damaged header may claim more.
_LARGEST_AREA: Final = 1 << 28
# Above this size in bytes, the pixels must be plausible for the size of the file. Deflate, which
# PNG, TIFF and OpenEXR use, expands one byte to at most 1032 (RFC 1951: 258 bytes from two bits).
_LARGE: Final = 1 << 28
_LARGEST_RATIO: Final = 4096
# OpenImageIO's names of channels of which a file does not say what they are.
_UNNAMED: Final = re.compile(r"channel\d+\Z|\Z")
# The code point of an unspecified curve.
_UNSPECIFIED: Final = 2
# The most parts that are listed. Some files have thousands, and each takes time.
_MAX_PARTS: Final = 100


@contextmanager
def opened(path: str | os.PathLike[str], purpose: str) -> Iterator[OpenImageIO.ImageInput]:
    """Open an image file; the context closes it."""
    oiio = import_extra("OpenImageIO", "images", purpose)
    name = check_name(path)
    # OpenImageIO reports missing and damaged files alike; this raises the system's own reason.
    with open(name, "rb"):
        pass
    if name.lower().endswith(".npy"):
        raise ValueError(
            f"{name}: is a NumPy array, not an image; write it as one: "
            f"vkbloom.write('image.exr', numpy.load({name!r}))"
        )
    # Otherwise OpenImageIO multiplies straight colours by alpha.
    plain = oiio.ImageSpec()
    plain.attribute("oiio:UnassociatedAlpha", 1)
    # (Some readers open the file again when they go to another part.)
    with for_c(name) as given:
        with readable(name) as file, for_c(file) as first:
            reader = oiio.ImageInput.open(given if file == name else first, plain)
        reason = failure_of(oiio).replace(given, name) if reader is None else ""
        if _is_lab(reader, reason) or _is_grey_photoshop(reader, name):
            # libtiff converts L*a*b* to 8 bits without adapting the white of D50, or does not
            # convert. OpenImageIO takes the layers of a grey Photoshop file for RGB.
            plain.attribute("oiio:RawColor", 1)
            reader = oiio.ImageInput.open(given, plain)
        if (reader is None or reader.format_name() == "tiff") and is_raw(name):
            # A TIFF reader takes the preview for the picture.
            if reader is not None:
                reader.close()
            raise ValueError(f"{name}: is {RAW_ADVICE}")
        if reader is None:
            reason = HEIF_ADVICE if is_heif(name) else reason or "unknown format"
            raise ValueError(f"{name}: is not a readable image: {reason}")
        try:
            yield reader
        finally:
            failure_of(reader)
            reader.close()


def _is_lab(reader: OpenImageIO.ImageInput | None, reason: str) -> bool:
    """Whether a file has L*, a* and b*, or may have; `reason`: why it cannot be opened."""
    if reader is None:
        return "PhotometricInterpretation" in reason
    return reader.spec().get_string_attribute("tiff:ColorSpace") in LAB


def _is_grey_photoshop(reader: OpenImageIO.ImageInput | None, name: str) -> bool:
    """Whether a file is a Photoshop file of grey."""
    if reader is None or reader.format_name() != "psd":
        return False
    with open(name, "rb") as stream:
        # The colour mode.
        return stream.read(26)[24:] == b"\0\1"


def readable_extensions() -> set[str]:
    """Return the extensions of the formats that can be read, such as ".png"."""
    oiio = import_extra("OpenImageIO", "images", "Reading images")
    # "openexr:exr,sxr,mxr;png:png;..."
    formats = oiio.get_string_attribute("input_format_list").split(",")
    listed = oiio.get_string_attribute("extension_list").split(";")
    pairs = (entry.partition(":") for entry in listed)
    return {f".{word}" for name, _, words in pairs if name in formats for word in words.split(",")}


def check_plausible(spec: OpenImageIO.ImageSpec, path: str | os.PathLike[str]) -> None:
    """Raise ValueError if a file is far too short for the pixels that its header claims."""
    size = spec.image_bytes()
    if size > max(_LARGE, _LARGEST_RATIO * os.path.getsize(path)):
        raise ValueError(
            f"{os.fspath(path)}: damaged: {os.path.getsize(path)} bytes cannot hold "
            f"{spec.width} x {spec.height} pixels"
        )


def load(path: str | os.PathLike[str], subimage: int = 0, layer: str | None = None) -> StoredImage:
    """Read an image file."""
    with opened(path, "Reading images") as reader:
        return _read(reader, os.fspath(path), subimage, layer)


def _read(
    reader: OpenImageIO.ImageInput, name: str, subimage: int, layer: str | None
) -> StoredImage:
    subimage, spec, notes = _chosen_part(reader, name, subimage, layer)
    kind = reader.format_name()
    pixels, said = _pixels(reader, spec, name, subimage)
    notes += said
    meaning = meaning_of(reader, spec, name)
    if kind == "psd" and not subimage and channels_of(spec, kind) == ("Y", "A"):
        over_white = without_white(pixels)
        if over_white is not None:
            pixels, meaning = over_white, Meaning.MULTIPLIED
    pixels, origin, display = _placed(pixels, spec, kind)
    kept = [index for index, part in enumerate(_layers(spec)) if layer in (None, part)]
    names = [
        "" if channel == "A" and meaning is Meaning.NONE else channel
        for channel in channels_of(spec, kind)
    ]
    points, known = spec.getattribute("CICP"), points_of(spec)
    stated = stated_colours(spec, kind, name, has_points=known is not None)
    notes += [
        f"the file says {said} of its values, which are taken as they are" for said in stated.said
    ]
    if points is not None and known is None and points[1] != _UNSPECIFIED:
        numbers = " ".join(map(str, points))
        notes.insert(0, f"the code points {numbers} of its colours are not known, and are ignored")
    stored = StoredImage(
        pixels=np.ascontiguousarray(pixels if layer is None else pixels[:, :, kept]),
        channels=tuple(names if layer is None else (names[i].rpartition(".")[2] for i in kept)),
        numbers=tuple(_numbers(pixels, spec, kind)[index] for index in kept),
        origin=origin,
        display=display,
        associated=meaning is Meaning.MULTIPLIED,
        space=stated.space,
        gamma=stated.gamma,
        primaries=stated.primaries,
        attributes={
            attribute.name: (attribute.type, attribute.value)
            for attribute in spec.extra_attribs
            if is_kept(attribute.name)
        },
        own=own_attributes(spec) if kind == "openexr" else {},
        profile_name=spec.get_string_attribute("ICCProfile:profile_description"),
        code_points=known,
        is_ultra_hdr=_is_ultra_hdr(reader, spec),
        is_encoded=kind == "jpegxl",
        part=subimage,
        notes=tuple(notes),
    )
    # Last, since the reader goes to other parts.
    parts = itertools.islice(_parts(reader), _MAX_PARTS)
    return replace(stored, parts=tuple(map(_name_of, parts)))


def _pixels(
    reader: OpenImageIO.ImageInput, spec: OpenImageIO.ImageSpec, name: str, subimage: int
) -> tuple[NDArray[Any], list[str]]:
    """Return the values (H, W, C) of a part of a file, and notes."""
    wanted = str(spec.format) if str(spec.format) != "double" else "float"
    data = reader.read_image(subimage, 0, 0, spec.nchannels, wanted)
    notes = warnings_of(reader, name)
    dtype = {**DTYPES, **SIGNED}[str(spec.format)]
    pixels = np.asarray(complete(data, reader, name), dtype).reshape(
        spec.height, spec.width, spec.nchannels
    )
    pixels, said = corrected(pixels, spec, reader.format_name(), name)
    if reader.format_name() == "jpegxl" and header_of(name).has_coarse_light:
        said = [
            "its colours are stored in another space than that of its ICC profile, and are decoded "
            "to linear Rec. 709; colours outside of it are clipped"
        ]
    return pixels, [*notes, *said]


def _placed(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec, kind: str
) -> tuple[NDArray[Any], tuple[int, int], Window]:
    """Return the pixels upright, the origin and the display window.

    The pixels of OpenEXR cover both windows. Positions of other formats are those on a page, which
    do not move the picture.
    """
    origin, display = (0, 0), (0, 0, pixels.shape[1], pixels.shape[0])
    if kind in WITH_WINDOWS:
        pixels, origin, display = _in_windows(pixels, spec)
    orientation = spec.get_int_attribute("Orientation", 1)
    if orientation == 1:
        return pixels, origin, display
    x, y = display[0] - origin[0], display[1] - origin[1]
    pixels = upright(pixels[y : y + display[3], x : x + display[2]], orientation)
    return pixels, (0, 0), (0, 0, pixels.shape[1], pixels.shape[0])


def _in_windows(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec
) -> tuple[NDArray[Any], tuple[int, int], Window]:
    """Return the pixels of the data window and the display window, the origin, and the latter."""
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    left, top = min(spec.x, display[0]), min(spec.y, display[1])
    width, height = _covered(spec)
    if pixels.shape[:2] != (height, width):
        row, column = spec.y - top, spec.x - left
        whole = np.zeros((height, width, spec.nchannels), pixels.dtype)
        whole[row : row + spec.height, column : column + spec.width] = pixels
        pixels = whole
    return pixels, (left, top), display


def _numbers(pixels: NDArray[Any], spec: OpenImageIO.ImageSpec, kind: str) -> list[str]:
    """Return OpenImageIO's name of each channel's number type."""
    if kind == "fits" and scale_of(spec) != (1, 0):
        return [PIXEL_TYPES[pixels.dtype.name]] * spec.nchannels
    return [str(spec.channelformat(index)) for index in range(spec.nchannels)]


def _chosen_part(
    reader: OpenImageIO.ImageInput, name: str, subimage: int, layer: str | None
) -> tuple[int, OpenImageIO.ImageSpec, list[str]]:
    """Make the part to read the current one, and return its number, what it is, and notes."""
    notes: list[str] = []
    if layer is not None:
        subimage = _part_with(reader, name, subimage, layer)
    elif subimage == 0 and reader.format_name() == "tiff":
        subimage, notes = _full_picture(name)
    if subimage < 0 or not _seek(reader, subimage):
        count = sum(1 for _ in _parts(reader))
        raise ValueError(f"{name}: subimage {subimage} is not in 0..{count - 1}")
    spec = reader.spec()
    if spec.width < 1 or spec.height < 1:
        more = f"; subimage {subimage + 1} is another" if _seek(reader, subimage + 1) else ""
        raise ValueError(f"{name}: there are no pixels in this part of the file{more}")
    spec.attribute(
        "Orientation",
        orientation_of(name, reader.format_name(), spec.getattribute("Orientation")),
    )
    if reader.format_name() == "fits":
        # OpenImageIO does not know Fortran's exponents.
        for field, value in zip(("Bscale", "Bzero"), fits_scale(name, subimage), strict=True):
            spec.attribute(field, value)
    if spec.deep or spec.depth > 1:
        raise ValueError(f"{name}: a deep image or a volume is not supported; use a flat image")
    is_scaled = reader.format_name() == "fits" and scale_of(spec) != (1, 0)
    if str(spec.format) not in DTYPES and not (is_scaled and str(spec.format) in SIGNED):
        raise ValueError(
            f"{name}: numbers of {spec.format} are not supported; use unsigned integers of 8 or 16 "
            "bits, or floats"
        )
    if reader.format_name() == "tiff" and str(spec.format) == "double" and spec.tile_width:
        # OpenImageIO 3.2 returns memory that it has not written.
        raise ValueError(f"{name}: tiles of doubles are not supported; use strips, or floats")
    has_windows = reader.format_name() in WITH_WINDOWS
    width, height = _covered(spec) if has_windows else (spec.width, spec.height)
    if max(width, height) > _LARGEST_SIDE or width * height > _LARGEST_AREA:
        raise ValueError(
            f"{name}: {width} x {height} is larger than {_LARGEST_SIDE} pixels on a side or "
            f"{_LARGEST_AREA} in all"
        )
    check_plausible(spec, name)
    return subimage, spec, notes


def _full_picture(name: str) -> tuple[int, list[str]]:
    """Return the first part of a TIFF file that is no reduced picture, and a note about it."""
    reduced = reduced_parts(name)
    if not any(reduced[:1]):
        return 0, []
    if all(reduced):
        return 0, ["the picture is a reduced one, as the file says; the full one cannot be read"]
    part = reduced.index(False)
    return part, [f"part 0 is a reduced picture, as the file says; read part {part}"]


def _covered(spec: OpenImageIO.ImageSpec) -> tuple[int, int]:
    """Return the size of the area of the data window and the display window."""
    right = max(spec.x + spec.width, spec.full_x + spec.full_width)
    bottom = max(spec.y + spec.height, spec.full_y + spec.full_height)
    return right - min(spec.x, spec.full_x), bottom - min(spec.y, spec.full_y)


def points_of(spec: OpenImageIO.ImageSpec) -> tuple[int, ...] | None:
    """Return the code points of a file's colours, if it has them and they are known."""
    points = spec.getattribute("CICP")
    if points is not None and spec.nchannels < 3:
        # Grey has no primaries.
        points = (1, *points[1:])
    return None if points is None or of_code_points(points) is None else tuple(points)


def _is_ultra_hdr(reader: OpenImageIO.ImageInput, spec: OpenImageIO.ImageSpec) -> bool:
    """Whether OpenImageIO applies the gain map of a JPEG file."""
    return reader.format_name() == "jpeg" and str(spec.format) == "half"


def highlights_of(
    reader: OpenImageIO.ImageInput, subimage: int = 0, colour: Colour | None = None
) -> Highlights:
    """Return what a part of a file has of highlights; `colour`: as for `decode_file`."""
    if not _seek(reader, max(subimage, 0)):
        # The error comes from `load`.
        return Highlights.STORED
    spec = reader.spec()
    is_ultra_hdr = _is_ultra_hdr(reader, spec)
    return _highlights(str(spec.format), points_of(spec), colour, is_ultra_hdr=is_ultra_hdr)


def _highlights(
    numbers: str, points: tuple[int, ...] | None, colour: Colour | None, *, is_ultra_hdr: bool
) -> Highlights:
    if is_ultra_hdr:
        return Highlights.MAPPED
    is_hdr = colour is None and has_hdr_curve(points)
    is_clipped = numbers in ("uint8", "uint16") and not is_hdr
    return Highlights.CLIPPED if is_clipped else Highlights.STORED


def _seek(reader: OpenImageIO.ImageInput, subimage: int) -> bool:
    """Make a part the current one, if there is such a part."""
    is_there: bool = reader.seek_subimage(subimage, 0)
    if not is_there:
        # Some readers leave an error, which would be taken for damaged pixels.
        failure_of(reader)
    return is_there


def _layers(spec: OpenImageIO.ImageSpec) -> list[str]:
    """Return the layer of each channel: the prefix of its name, or else the name of the part."""
    return [name.rpartition(".")[0] or _name_of(spec) for name in spec.channelnames]


def _name_of(spec: OpenImageIO.ImageSpec) -> str:
    name: str = spec.get_string_attribute("oiio:subimagename")
    return name


def _part_with(reader: OpenImageIO.ImageInput, name: str, subimage: int, layer: str) -> int:
    """Return the first part, from `subimage` on, that has a layer."""
    known: dict[str, None] = {}
    first = max(subimage, 0)
    for index, spec in enumerate(itertools.islice(_parts(reader, first), _MAX_PARTS), first):
        layers = _layers(spec)
        if layer in layers:
            return index
        known.update(dict.fromkeys(filter(None, layers)))
    said = f"its layers are {listed(known)}" if known else "it has no named layers"
    raise ValueError(f"{name}: there is no layer {layer!r}; {said}")


def _parts(reader: OpenImageIO.ImageInput, first: int = 0) -> Iterator[OpenImageIO.ImageSpec]:
    """Make each part the current one, and yield what it is."""
    for index in itertools.count(first):
        if not _seek(reader, index):
            return
        yield reader.spec()


def listed_parts(stored: StoredImage) -> str:
    """Return the parts of a file in words."""
    names = listed(f"{index} {name}" for index, name in enumerate(stored.parts) if name)
    return f"parts {names}" if names else f"{len(stored.parts)} parts"


def non_finite_note(nan: int, infinite: int) -> str | None:
    """Return a note about values that are not finite; None: there are none."""
    if not nan and not infinite:
        return None
    return (
        f"has {nan} NaN and {infinite} infinite values; they count as 0 in the bloom, and stay in "
        "the picture"
    )


def _decoded(stored: StoredImage, colour: Colour | None, expand: float | None) -> Picture:
    chosen, left_out = _chosen_channels(stored.channels)
    values = stored.pixels[:, :, chosen]
    kinds = {stored.numbers[index] for index in chosen}
    numbers = kinds.pop() if len(kinds) == 1 else "float"
    if numbers == "half":
        # OpenImageIO reads all channels as float if one channel is float.
        values = values.astype(np.float16, copy=False)
    notes = [*stored.notes]
    if left_out:
        notes.append(f"left out the channels {listed(left_out)}")
    grey = len(chosen) < 3
    if grey:
        values = values[:, :, [0, 0, 0, *range(1, len(chosen))]]
    has_alpha = values.shape[2] == 4
    if stored.associated and has_alpha and (values.dtype.kind == "u" or stored.is_encoded):
        if values.dtype.kind == "u":
            # 16 bits hold the quotients of 8 bits.
            scale = 65535 // np.iinfo(values.dtype).max
            values = values.astype(np.uint16) * np.uint16(scale)
        values = divided(values)
        stored = replace(stored, associated=False)
    taken_as, values, said = linear(values, stored, colour)
    notes += said
    highlights = _highlights(numbers, stored.code_points, colour, is_ultra_hdr=stored.is_ultra_hdr)
    if highlights is Highlights.CLIPPED:
        values = expanded(values, expand)
    if colour not in (None, "linear", "srgb"):
        stored = replace(stored, own=without_colours(stored.own))
    stored = replace(stored, attributes=_attributes_of_linear(stored, taken_as, colour))
    hidden = visible = 0.0
    if has_alpha and not stored.associated:
        hidden, visible = light_of(values)
    return Picture(
        pixels=np.ascontiguousarray(values),
        encoding="linear",
        numbers=numbers,
        grey=grey,
        stored=stored,
        notes=tuple(notes),
        colour=taken_as,
        hidden=hidden,
        visible=visible,
        highlights=highlights,
    )


def decode_file(
    stored: StoredImage, file: str, colour: Colour | None = None, *, expand: float | None = None
) -> Picture:
    """Decode a stored image to a picture of linear values; a ValueError names the file."""
    try:
        return _decoded(stored, colour, expand)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from error


def _chosen_channels(names: tuple[str, ...]) -> tuple[list[int], list[str]]:
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
            f"the layers are {listed(filter(None, layers))}; name one as the layer to read"
        )
    else:
        raise ValueError(
            f"the channels {listed(names)} are not R, G, B or a single one, with or without alpha"
        )
    return chosen, [name for index, name in enumerate(names) if name and index not in chosen]


def _attributes_of_linear(
    stored: StoredImage, taken_as: str, colour: Colour | None
) -> dict[str, tuple[Any, Any]]:
    """Return the attributes without those that describe the colours before the conversion."""
    lost = set()
    if taken_as != "srgb":
        lost.add("ICCProfile")
    if colour not in (None, "linear", "srgb"):
        lost.add("chromaticities")
    return {name: value for name, value in stored.attributes.items() if name not in lost}
