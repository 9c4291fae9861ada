"""Single images from files and into files, with their colours handled knowingly.

Bloom is made of light, so that images are decoded to linear values before it, and encoded again
after it where the file holds integers. Which files hold what:

==================== ========================= =====================================
numbers in the file  taken as                  written as
==================== ========================= =====================================
8 or 16 bit integers sRGB, unless the file     sRGB
                     says that it is linear
half, float          linear                    linear
==================== ========================= =====================================
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom.extras import import_extra
from vkbloom.files import _check_extension, _is_readable, _reserve, _write_error

if TYPE_CHECKING:
    import OpenImageIO

__all__ = [
    "Colour",
    "Picture",
    "StoredImage",
    "check_writable",
    "decode",
    "decode_srgb",
    "encode_srgb",
    "load",
    "save",
]

Colour = Literal["linear", "srgb"]
Encoding = Literal["linear", "srgb", "gamma22"]
#: x, y, width, height in pixels.
Window: TypeAlias = tuple[int, int, int, int]

# The dtype in which numbers of a file are read, by OpenImageIO's names of them.
_DTYPES: Final[Mapping[str, np.dtype[Any]]] = {
    "uint8": np.dtype(np.uint8),
    "uint16": np.dtype(np.uint16),
    "half": np.dtype(np.float16),
    "float": np.dtype(np.float32),
    "double": np.dtype(np.float32),
}

# The numbers to write, best first, by those that the picture came with. 16 bits come last for
# floats, because files of 8 bits are what a PNG of a float picture is expected to be.
_PREFERENCES: Final[Mapping[str, tuple[str, ...]]] = {
    "uint8": ("uint8", "float", "half", "uint16"),
    "uint16": ("uint16", "float", "half", "uint8"),
    "half": ("half", "float", "uint8", "uint16"),
    "float": ("float", "half", "uint8", "uint16"),
    "double": ("float", "half", "uint8", "uint16"),
}

# OpenImageIO's names of colour spaces.
_SPACES: Final[Mapping[str, str]] = {
    "linear": "lin_rec709_scene",
    "srgb": "srgb_rec709_scene",
    "gamma22": "g22_rec709_scene",
}

# Attributes that tell what the colours or the pixels are, and hold for the result as well.
_KEPT: Final = ("chromaticities", "PixelAspectRatio")

_LARGEST_SIDE: Final = 65536
# What the largest texture of 16384 x 16384 holds; keeps a damaged header from being taken at
# its word.
_LARGEST_AREA: Final = 1 << 28


def decode_srgb(encoded: NDArray[Any]) -> NDArray[Any]:
    """Turn sRGB values into linear ones.

    Parameters
    ----------
    encoded : ndarray of float
        Any shape; 0..1, beyond which the curve goes on.

    Returns
    -------
    ndarray
        The same shape and dtype: x / 12.92 up to 0.04045, then ((x + 0.055) / 1.055)^2.4
        (IEC 61966-2-1).
    """
    kind = encoded.dtype.type
    # The maximum keeps the power defined where the line is used.
    curve = ((np.maximum(encoded, kind(0.04045)) + kind(0.055)) / kind(1.055)) ** kind(2.4)
    linear: NDArray[Any] = np.where(encoded <= kind(0.04045), encoded / kind(12.92), curve)
    return linear


def encode_srgb(linear: NDArray[Any]) -> NDArray[Any]:
    """Turn linear values into sRGB ones, the inverse of `decode_srgb`.

    Parameters
    ----------
    linear : ndarray of float
        Any shape; 0..1, beyond which the curve goes on.

    Returns
    -------
    ndarray
        The same shape and dtype: 12.92 x up to 0.0031308, then 1.055 x^(1 / 2.4) - 0.055
        (IEC 61966-2-1).
    """
    kind = linear.dtype.type
    curve = kind(1.055) * np.maximum(linear, kind(0.0031308)) ** kind(1 / 2.4) - kind(0.055)
    encoded: NDArray[Any] = np.where(linear <= kind(0.0031308), linear * kind(12.92), curve)
    return encoded


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredImage:
    """An image as a file holds it: every channel, no value changed.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, C)
        uint8, uint16, float16 or float32 (also of doubles), top row first, upright where the
        file has an orientation. They cover the data window and the display window; what the
        file has no data for is 0.
    channels : tuple of str
        The C names, such as ("R", "G", "B", "A").
    numbers : tuple of str
        OpenImageIO's name of each channel's numbers: "uint8", "uint16", "half", "float" or
        "double".
    origin : (int, int)
        Of the pixels, in the file's coordinates.
    display : (int, int, int, int)
        The display window (x, y, width, height), in the file's coordinates.
    associated : bool
        Whether the file's format says that colours are multiplied by alpha.
    space : str
        OpenImageIO's name of the colour space that the file gives, else "".
    attributes : mapping of str to (OpenImageIO.TypeDesc, value)
        The attributes that `save` keeps.
    """

    pixels: NDArray[Any]
    channels: tuple[str, ...]
    numbers: tuple[str, ...]
    origin: tuple[int, int]
    display: Window
    associated: bool
    space: str
    attributes: Mapping[str, tuple[Any, Any]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Picture:
    """An image that `vkbloom.Renderer.apply` takes, with what it needs to become a file again.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3) or (H, W, 4)
        uint8, float16 or float32; grey images have three equal colours.
    encoding : {"linear", "srgb", "gamma22"} or None
        What the colours are. None: not known, as nothing was done to them.
    numbers : str
        OpenImageIO's name of the numbers in the file.
    grey : bool
        Whether the file has one channel instead of three.
    stored : StoredImage
        What the file holds besides.
    notes : tuple of str
        What the user may want to know about how the file was taken.
    """

    pixels: NDArray[Any]
    encoding: Encoding | None
    numbers: str
    grey: bool
    stored: StoredImage
    notes: tuple[str, ...] = ()

    @classmethod
    def of_values(cls, pixels: NDArray[Any], numbers: str = "uint8") -> Self:
        """Make a picture whose values `save` writes as they are, its 1 being white.

        Parameters
        ----------
        pixels : ndarray, shape (H, W, 3) or (H, W, 4)
            uint8, float16 or float32.
        numbers : str
            OpenImageIO's name of the numbers to write where the file's format has them.
        """
        height, width, channels = pixels.shape
        stored = StoredImage(
            pixels=pixels,
            channels=("R", "G", "B", "A")[:channels],
            numbers=(numbers,) * channels,
            origin=(0, 0),
            display=(0, 0, width, height),
            associated=False,
            space="",
            attributes={},
        )
        return cls(pixels=pixels, encoding=None, numbers=numbers, grey=False, stored=stored)

    @property
    def values(self) -> NDArray[Any]:
        """The pixels with one channel of the three equal ones of a grey image."""
        return self.pixels[:, :, [0, *range(3, self.pixels.shape[2])] if self.grey else slice(None)]


def load(path: str | os.PathLike[str], subimage: int = 0) -> StoredImage:
    """Read an image file.

    Parameters
    ----------
    path : str or path-like
        Of any format that OpenImageIO reads.
    subimage : int, default 0
        Which part of a file that has several (OpenEXR, TIFF, GIF), from 0 on.

    Returns
    -------
    StoredImage

    Raises
    ------
    OSError
        The file is not there, or cannot be opened; it names the file.
    ValueError
        The file is damaged or no image, has no such part, or is no flat image of 8 or 16 bit
        integers or floats; it names the file.
    ModuleNotFoundError
        OpenImageIO is missing.
    """
    oiio = import_extra("OpenImageIO", "images", "Reading images")
    name = os.fspath(path)
    # OpenImageIO says the same of missing and of damaged files; this has the system's own reason.
    with open(name, "rb"):
        pass
    # Without this, colours would be multiplied by alpha where the file has them plain.
    plain = oiio.ImageSpec()
    plain.attribute("oiio:UnassociatedAlpha", 1)
    reader = oiio.ImageInput.open(name, plain)
    if reader is None:
        reason = oiio.geterror().strip() or "unknown format"
        raise ValueError(f"{name}: not an image that can be read: {reason}")
    try:
        return _read(reader, name, subimage)
    finally:
        # An error that nobody asked for would be printed when the reader is gone.
        reader.geterror()
        reader.close()


def _read(reader: OpenImageIO.ImageInput, name: str, subimage: int) -> StoredImage:
    if subimage < 0 or not reader.seek_subimage(subimage, 0):
        count = 0
        while reader.seek_subimage(count, 0):
            count += 1
        raise ValueError(f"{name}: there is no part {subimage}, only 0 to {count - 1}")
    spec = reader.spec()
    if spec.deep or spec.depth > 1:
        raise ValueError(f"{name}: a flat image is needed, not a deep one or a volume")
    stored_as = str(spec.format)
    if stored_as not in _DTYPES:
        raise ValueError(
            f"{name}: holds numbers of {stored_as}; 8 or 16 bit unsigned integers or floats are "
            "needed"
        )
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    left, top = min(spec.x, display[0]), min(spec.y, display[1])
    width = max(spec.x + spec.width, display[0] + display[2]) - left
    height = max(spec.y + spec.height, display[1] + display[3]) - top
    if max(width, height) > _LARGEST_SIDE or width * height > _LARGEST_AREA:
        raise ValueError(f"{name}: {width} x {height} pixels are too many")
    dtype = _DTYPES[stored_as]
    wanted = stored_as if stored_as != "double" else "float"
    data = reader.read_image(subimage, 0, 0, spec.nchannels, wanted)
    # Of a JPEG that was cut off there are pixels, and an error.
    reason = reader.geterror().strip()
    if data is None or reason:
        raise ValueError(f"{name}: damaged: {reason or 'the pixels cannot be read'}")
    pixels = np.asarray(data, dtype).reshape(spec.height, spec.width, spec.nchannels)
    if pixels.shape[:2] != (height, width):
        row, column = spec.y - top, spec.x - left
        whole = np.zeros((height, width, spec.nchannels), dtype)
        whole[row : row + spec.height, column : column + spec.width] = pixels
        pixels = whole
    orientation = spec.get_int_attribute("Orientation", 1)
    if orientation != 1:
        x, y = display[0] - left, display[1] - top
        pixels = _upright(pixels[y : y + display[3], x : x + display[2]], orientation)
        left, top = 0, 0
        display = (0, 0, pixels.shape[1], pixels.shape[0])
    return StoredImage(
        pixels=np.ascontiguousarray(pixels),
        channels=tuple(spec.channelnames),
        numbers=tuple(str(spec.channelformat(index)) for index in range(spec.nchannels)),
        origin=(left, top),
        display=display,
        associated=spec.alpha_channel >= 0 and not spec.get_int_attribute("oiio:UnassociatedAlpha"),
        space=spec.get_string_attribute("oiio:ColorSpace"),
        attributes={
            attribute.name: (attribute.type, attribute.value)
            for attribute in spec.extra_attribs
            if attribute.name in (*_KEPT, "ICCProfile")
        },
    )


def _upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Undo an orientation of TIFF 6.0 (also Exif), 1 to 8: where the first row and column are."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def decode(stored: StoredImage, colour: Colour | None = None, *, raw: bool = False) -> Picture:
    """Make a picture of linear values out of what a file holds.

    Parameters
    ----------
    stored : StoredImage
    colour : {"linear", "srgb"}, optional
        What the colours in the file are. By default floats are linear, and integers sRGB unless
        the file says that they are linear.
    raw : bool, default False
        Leave 8-bit values as they are.

    Returns
    -------
    Picture
        Of float16 where the file has half, of float32 for all else; of uint8 if `raw`. Colours
        are neither multiplied nor divided by alpha.

    Raises
    ------
    ValueError
        The channels are neither RGB, RGBA, grey nor grey with alpha; `raw` and the file does not
        hold 8-bit integers, or `colour` is given as well.
    """
    if raw and colour is not None:
        raise ValueError(f"colour: {colour!r} has no meaning for raw values")
    chosen, left_out = _chosen_channels(stored.channels)
    values = stored.pixels[:, :, chosen]
    kinds = {stored.numbers[index] for index in chosen}
    numbers = kinds.pop() if len(kinds) == 1 else "float"
    if raw and numbers != "uint8":
        raise ValueError(f"raw: 8-bit integers are needed, not {numbers}")
    if numbers == "half":
        # Another channel may have made the whole file float.
        values = values.astype(np.float16, copy=False)
    notes = [f"left out the channels {', '.join(left_out)}"] if left_out else []
    encoding: Encoding | None = None
    if not raw:
        encoding = colour or _encoding_given_by(stored, values.dtype)
        if stored.space not in ("", *_SPACES.values()) or stored.space == _SPACES["gamma22"]:
            notes.append(f"the file says {stored.space} of its colours; taken as {encoding}")
        elif values.dtype.kind == "f" and stored.space == _SPACES["srgb"] and colour is None:
            notes.append("the file says srgb of its colours, which as floats are taken as linear")
        values = _linear(values, encoding, len(chosen) in (2, 4))
        if encoding != "srgb":
            # A profile of what will be encoded otherwise.
            kept = {name: stored.attributes[name] for name in _KEPT if name in stored.attributes}
            stored = replace(stored, attributes=kept)
        encoding = "linear"
    grey = len(chosen) < 3
    if grey:
        values = values[:, :, [0, 0, 0, *range(1, len(chosen))]]
    return Picture(
        pixels=np.ascontiguousarray(values),
        encoding=encoding,
        numbers=numbers,
        grey=grey,
        stored=stored,
        notes=tuple(notes),
    )


def _chosen_channels(names: tuple[str, ...]) -> tuple[list[int], list[str]]:
    """Return the places of the colour and alpha, and the names of the channels left out."""
    layers = {name.rpartition(".")[0] for name in names}
    # One layer's name before every channel says nothing.
    plain = [name.rpartition(".")[2] if len(layers) == 1 else name for name in names]
    places = {name.upper(): index for index, name in reversed(list(enumerate(plain)))}
    alpha = [places[name] for name in ("A", "ALPHA") if name in places][:1]
    if {"R", "G", "B"} <= places.keys():
        chosen = [places["R"], places["G"], places["B"], *alpha]
    elif len(names) == 1 + len(alpha):
        chosen = [index for index in range(len(names)) if index not in alpha] + alpha
    else:
        raise ValueError(
            f"the channels are {', '.join(names)}; R, G, B or one, with or without alpha, are "
            "needed"
        )
    return chosen, [name for index, name in enumerate(names) if index not in chosen]


def _encoding_given_by(stored: StoredImage, dtype: np.dtype[Any]) -> Colour:
    return "linear" if dtype.kind == "f" or stored.space == _SPACES["linear"] else "srgb"


def _linear(values: NDArray[Any], encoding: Encoding, has_alpha: bool) -> NDArray[Any]:
    """Return floats of linear colours; alpha is only scaled."""
    colours = values.shape[2] - has_alpha
    if values.dtype.kind == "f":
        if encoding == "linear":
            return values
        linear = values.astype(np.float32)
        with np.errstate(over="ignore"):
            linear[:, :, :colours] = decode_srgb(linear[:, :, :colours])
            return linear.astype(values.dtype)
    # By table: exact for each of the few values that there are.
    scale = np.iinfo(values.dtype).max
    plain = np.arange(scale + 1) / scale
    table = (decode_srgb(plain) if encoding == "srgb" else plain).astype(np.float32)
    decoded: NDArray[Any] = table[values]
    if has_alpha:
        decoded[:, :, colours:] = plain.astype(np.float32)[values[:, :, colours:]]
    return decoded


def check_writable(path: str | os.PathLike[str]) -> None:
    """Find out whether a file's extension is of a format that can be written.

    Parameters
    ----------
    path : str or path-like

    Raises
    ------
    ValueError
        It is not.
    ModuleNotFoundError
        OpenImageIO is missing.
    """
    _check_extension(import_extra("OpenImageIO", "images", "Writing images"), Path(path).suffix)


def save(
    picture: Picture,
    path: str | os.PathLike[str],
    colour: Colour | None = None,
    attributes: Mapping[str, str] | None = None,
) -> tuple[str, ...]:
    """Write a picture to a file, in the numbers that it came with or the next best ones.

    Grey becomes one channel and windows are kept where the format has such; else grey becomes
    RGB, and what is outside the display window is cut off. NaN becomes 0 and infinity 1 in
    integers, which hold 0..1. Alpha is written as it is.

    Parameters
    ----------
    picture : Picture
    path : str or path-like
        With an extension that OpenImageIO writes. What is there is replaced, when the whole file
        is written under another name.
    colour : {"linear", "srgb"}, optional
        What the colours in the file shall be. By default integers are sRGB and floats linear.
    attributes : mapping of str to str, optional
        Added to the file where its format has a place for them.

    Returns
    -------
    tuple of str
        What the user may want to know about what the file could not hold.

    Raises
    ------
    ValueError
        The extension is unknown; the format cannot hold pictures of this kind; `colour` is given
        for a picture that is not linear.
    OSError
        The file cannot be written; it names the file, and no half file is left.
    ModuleNotFoundError
        OpenImageIO is missing.
    """
    if colour is not None and picture.encoding != "linear":
        raise ValueError(f"colour: {colour!r} needs a linear picture, not {picture.encoding}")
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    target = Path(path)
    _check_extension(oiio, target.suffix)
    temporary = _reserve(target, [picture.values])
    try:
        notes = _write(oiio, picture, colour, temporary, target, attributes=attributes or {})
        # Not all writers notice that a disk is full.
        if not _is_readable(oiio, temporary):
            raise OSError(errno.EIO, "not written completely; is the disk full?", str(target))
        try:
            temporary.replace(target)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(target)) from error
    finally:
        temporary.unlink(missing_ok=True)
    return notes


def _write(
    oiio: ModuleType,
    picture: Picture,
    colour: Colour | None,
    temporary: Path,
    target: Path,
    *,
    attributes: Mapping[str, str],
) -> tuple[str, ...]:
    writer = oiio.ImageOutput.create(str(temporary))
    chosen = _chosen_form(oiio, picture, writer, temporary)
    if chosen is None:
        raise ValueError(f"{target}: {writer.format_name()} cannot hold such a picture")
    values, numbers = chosen
    integer = numbers.startswith("uint")
    has_alpha = values.shape[2] in (2, 4)
    notes = _losses(picture, target, values, has_alpha, integer)
    encoding = picture.encoding
    if encoding == "linear" and (colour or ("srgb" if integer else "linear")) == "srgb":
        values, encoding = _encoded(values, has_alpha), "srgb"
    values = _as_numbers(values, numbers)

    stored = picture.stored
    x, y, width, height = stored.display
    if not writer.supports("displaywindow"):
        row, column = y - stored.origin[1], x - stored.origin[0]
        values = values[row : row + height, column : column + width]
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], numbers)
    if values.shape[2] < 3:
        spec.channelnames = ("Y", "A")[: values.shape[2]]
        spec.alpha_channel = 1 if has_alpha else -1
    if writer.supports("displaywindow"):
        spec.x, spec.y = stored.origin
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = stored.display
    _describe(spec, picture, encoding, target)
    for name, text in attributes.items():
        spec.attribute(name, text)
    is_written = (
        writer.open(str(temporary), spec)
        and writer.write_image(np.ascontiguousarray(values))
        and writer.close()
    )
    if not is_written:
        raise _write_error(writer, temporary, target)
    # An error that nobody asked for would be printed when the writer is gone.
    writer.geterror()
    return tuple(notes)


def _chosen_form(
    oiio: ModuleType, picture: Picture, writer: OpenImageIO.ImageOutput, temporary: Path
) -> tuple[NDArray[Any], str] | None:
    """Return the channels and the numbers to write, those most like the picture's first."""
    for values in _layouts(picture, writer.supports("alpha") != 0):
        for numbers in _PREFERENCES[picture.numbers]:
            if _holds(oiio, temporary, values.shape[2], numbers):
                return values, numbers
    return None


def _layouts(picture: Picture, with_alpha: bool) -> Iterator[NDArray[Any]]:
    forms = [picture.values, picture.pixels] if picture.grey else [picture.pixels]
    if with_alpha:
        yield from forms
    if picture.pixels.shape[2] == 4:
        yield from (form[:, :, :-1] for form in forms)
    elif not with_alpha:
        yield from forms


def _holds(oiio: ModuleType, temporary: Path, channels: int, numbers: str) -> bool:
    """Tell whether a format keeps a number of channels and a type of numbers.

    A format answers only once a file is open, and libpng complains on stderr about a file
    without pixels; so one pixel is written.
    """
    spec = oiio.ImageSpec(1, 1, channels, numbers)
    writer = oiio.ImageOutput.create(str(temporary))
    is_open = writer.open(str(temporary), spec)
    if is_open:
        opened = writer.spec()
        is_open = (str(opened.format), opened.nchannels) == (numbers, channels)
        writer.write_image(np.zeros((1, 1, channels), _DTYPES[numbers]))
        writer.close()
    writer.geterror()
    return bool(is_open)


def _losses(
    picture: Picture, target: Path, values: NDArray[Any], has_alpha: bool, integer: bool
) -> list[str]:
    """Say what the file cannot hold of a picture, or will be read differently."""
    notes: list[str] = []
    is_float = values.dtype.kind == "f"
    if picture.pixels.shape[2] == 4:
        opaque = 1.0 if is_float else np.iinfo(values.dtype).max
        is_opaque = bool((picture.pixels[:, :, 3] == opaque).all())
        suffix = target.suffix.lower()
        # TIFF says for each file which of the two it is.
        associated = (suffix == ".exr") if suffix not in (".tif", ".tiff") else None
        if not has_alpha and not is_opaque:
            notes.append(f"{target} has no place for the alpha, which is not 1 everywhere")
        elif has_alpha and not is_opaque and associated is (not picture.stored.associated):
            notes.append(
                f"colours and alpha are written to {target} as they are, although readers of it "
                f"take the colours as {'' if associated else 'not '}multiplied by alpha"
            )
    if integer and is_float and not np.isfinite(values).all():
        notes.append(f"{target} holds integers: NaN is written as 0, infinity as 1")
    return notes


def _encoded(values: NDArray[Any], has_alpha: bool) -> NDArray[np.float32]:
    colours = values.shape[2] - has_alpha
    encoded = values.astype(np.float32)
    encoded[:, :, :colours] = encode_srgb(encoded[:, :, :colours])
    return encoded


def _as_numbers(values: NDArray[Any], numbers: str) -> NDArray[Any]:
    """Return values as the numbers of a file, whose 1 is the largest for integers."""
    dtype = _DTYPES[numbers]
    if values.dtype.kind == "u":
        if values.dtype == dtype:
            return values
        values = values / np.float32(np.iinfo(values.dtype).max)
    if dtype.kind == "f":
        return values.astype(dtype, copy=False)
    clipped = np.clip(np.nan_to_num(values.astype(np.float32), nan=0.0), 0.0, 1.0)
    whole: NDArray[Any] = np.rint(clipped * np.float32(np.iinfo(dtype).max)).astype(dtype)
    return whole


def _describe(
    spec: OpenImageIO.ImageSpec, picture: Picture, encoding: Encoding | None, target: Path
) -> None:
    """Say in a file what its colours, its alpha and its pixels are."""
    is_exr = target.suffix.lower() == ".exr"
    stored = picture.stored
    space = stored.space if encoding is None else _SPACES[encoding]
    # In OpenEXR linear goes without saying, and the primaries are in another attribute.
    if space and not (is_exr and encoding == "linear"):
        spec.attribute("oiio:ColorSpace", space)
    # Else OpenImageIO divides the colours by alpha where the format has them plain; TIFF can say
    # what they are.
    is_tiff = target.suffix.lower() in (".tif", ".tiff")
    if not is_exr and not (is_tiff and stored.associated):
        spec.attribute("oiio:UnassociatedAlpha", 1)
    # A profile describes encoded colours, not those of a picture that was written linear.
    profiles = ("ICCProfile",) if encoding in ("srgb", None) else ()
    for name in (*_KEPT, *profiles):
        if name in stored.attributes:
            kind, value = stored.attributes[name]
            spec.attribute(name, kind, value)
