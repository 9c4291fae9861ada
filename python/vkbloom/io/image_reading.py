"""Read image files, and decode them to the linear values that bloom is computed from."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.io.images import (
    DTYPES,
    KEPT_ATTRIBUTES,
    SPACES,
    Colour,
    Encoding,
    Picture,
    StoredImage,
    check_name,
    failure_of,
)
from vkbloom.io.srgb import decode_srgb

if TYPE_CHECKING:
    import OpenImageIO

__all__ = ["check_plausible", "decode", "load", "opened"]

_LARGEST_SIDE: Final = 65536
# Pixels of the largest texture, 16384 x 16384. A damaged header may claim more.
_LARGEST_AREA: Final = 1 << 28
# Above this size in bytes, the pixels must be plausible for the size of the file. Deflate, which
# PNG, TIFF and OpenEXR use, expands one byte to at most 1032 (RFC 1951: 258 bytes from two bits).
_LARGE: Final = 1 << 28
_LARGEST_RATIO: Final = 4096
# Number of listed parts. Some files have thousands, and reading each header takes time.
_MOST_PARTS: Final = 100


@contextmanager
def opened(path: str | os.PathLike[str], purpose: str) -> Iterator[OpenImageIO.ImageInput]:
    """Open an image file; the context closes it.

    Parameters
    ----------
    path : str or path-like
        A file of any format that OpenImageIO reads.
    purpose : str
        What needs OpenImageIO; the subject of the message if it is missing.

    Yields
    ------
    OpenImageIO.ImageInput
        The open file. Colours are read as stored, not multiplied by alpha.

    Raises
    ------
    OSError
        The file does not exist or cannot be opened; the error names it.
    ValueError
        The file is not an image, or its name is not UTF-8; the error names it.
    ModuleNotFoundError
        OpenImageIO is missing.
    """
    oiio = import_extra("OpenImageIO", "images", purpose)
    name = os.fspath(path)
    check_name(name)
    # OpenImageIO reports missing and damaged files alike; this raises the system's own reason.
    with open(name, "rb"):
        pass
    # Otherwise OpenImageIO multiplies straight colours by alpha.
    plain = oiio.ImageSpec()
    plain.attribute("oiio:UnassociatedAlpha", 1)
    reader = oiio.ImageInput.open(name, plain)
    if reader is None:
        reason = failure_of(oiio) or "unknown format"
        raise ValueError(f"{name}: is not a readable image: {reason}")
    try:
        yield reader
    finally:
        failure_of(reader)
        reader.close()


def check_plausible(spec: OpenImageIO.ImageSpec, path: str | os.PathLike[str]) -> None:
    """Raise ValueError if a file is far too short for the pixels that its header claims."""
    size = spec.image_bytes()
    if size > max(_LARGE, _LARGEST_RATIO * os.path.getsize(path)):
        raise ValueError(
            f"{os.fspath(path)}: damaged: {os.path.getsize(path)} bytes cannot hold "
            f"{spec.width} x {spec.height} pixels"
        )


def load(path: str | os.PathLike[str], subimage: int = 0) -> StoredImage:
    """Read an image file.

    Parameters
    ----------
    path : str or path-like
        A file of any format that OpenImageIO reads.
    subimage : int, default 0
        Index of the part of a file with several parts (OpenEXR, TIFF, GIF).

    Returns
    -------
    StoredImage

    Raises
    ------
    OSError
        The file does not exist or cannot be opened; the error names it.
    ValueError
        The file is damaged or not an image, has no such part, is not a flat image of 8-bit or
        16-bit integers or floats, or its name is not UTF-8; the error names the file.
    ModuleNotFoundError
        OpenImageIO is missing.
    """
    with opened(path, "Reading images") as reader:
        return _read(reader, os.fspath(path), subimage)


def _read(reader: OpenImageIO.ImageInput, name: str, subimage: int) -> StoredImage:
    if subimage < 0 or not reader.seek_subimage(subimage, 0):
        count = 0
        while reader.seek_subimage(count, 0):
            count += 1
        raise ValueError(f"{name}: subimage {subimage} is not in 0..{count - 1}")
    spec = reader.spec()
    if spec.deep or spec.depth > 1:
        raise ValueError(f"{name}: a deep image or a volume is not supported; use a flat image")
    stored_as = str(spec.format)
    if stored_as not in DTYPES:
        raise ValueError(
            f"{name}: numbers of {stored_as} are not supported; use unsigned integers of 8 or 16 "
            "bits, or floats"
        )
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    left, top = min(spec.x, display[0]), min(spec.y, display[1])
    width = max(spec.x + spec.width, display[0] + display[2]) - left
    height = max(spec.y + spec.height, display[1] + display[3]) - top
    if max(width, height) > _LARGEST_SIDE or width * height > _LARGEST_AREA:
        raise ValueError(
            f"{name}: {width} x {height} is larger than {_LARGEST_SIDE} pixels on a side or "
            f"{_LARGEST_AREA} in all"
        )
    check_plausible(spec, name)
    dtype = DTYPES[stored_as]
    wanted = stored_as if stored_as != "double" else "float"
    data = reader.read_image(subimage, 0, 0, spec.nchannels, wanted)
    # A truncated JPEG gives pixels and an error.
    reason = failure_of(reader)
    if data is None or reason:
        raise ValueError(f"{name}: damaged: {reason or 'the pixels cannot be read'}")
    pixels = np.asarray(data, dtype).reshape(spec.height, spec.width, spec.nchannels)
    if pixels.shape[:2] != (height, width):
        row, column = spec.y - top, spec.x - left
        padded = np.zeros((height, width, spec.nchannels), dtype)
        padded[row : row + spec.height, column : column + spec.width] = pixels
        pixels = padded
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
            if attribute.name in (*KEPT_ATTRIBUTES, "ICCProfile")
        },
        parts=tuple(_parts(reader)),
    )


def _parts(reader: OpenImageIO.ImageInput) -> Iterator[str]:
    for index in range(_MOST_PARTS):
        if not reader.seek_subimage(index, 0):
            return
        yield reader.spec().get_string_attribute("oiio:subimagename")


def _upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Undo an orientation of TIFF 6.0 and Exif, 1 to 8: the sides of the first row and column."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def decode(stored: StoredImage, colour: Colour | None = None, *, raw: bool = False) -> Picture:
    """Decode a stored image to a picture of linear values.

    Parameters
    ----------
    stored : StoredImage
    colour : {"linear", "srgb"}, optional
        Encoding of the colours in the file. Default: floats are linear; integers are sRGB unless
        the file says that they are linear.
    raw : bool, default False
        Whether to keep 8-bit values without decoding.

    Returns
    -------
    Picture
        float16 if the file has half, otherwise float32; uint8 if `raw`. Colours are neither
        multiplied nor divided by alpha.

    Raises
    ------
    ValueError
        The channels are not RGB, RGBA, grey or grey with alpha; or `raw` is set and the file does
        not have 8-bit integers, or `colour` is given as well.
    """
    if raw and colour is not None:
        raise ValueError(f"colour: {colour!r} cannot be combined with raw values")
    chosen, left_out = _chosen_channels(stored.channels)
    values = stored.pixels[:, :, chosen]
    kinds = {stored.numbers[index] for index in chosen}
    numbers = kinds.pop() if len(kinds) == 1 else "float"
    if raw and numbers != "uint8":
        raise ValueError(f"raw: {numbers} is not an 8-bit integer type")
    if numbers == "half":
        # OpenImageIO reads all channels as float if another channel is float.
        values = values.astype(np.float16, copy=False)
    notes = [f"left out the channels {', '.join(left_out)}"] if left_out else []
    encoding: Encoding | None = None
    if not raw:
        encoding = colour or _encoding_given_by(stored, values.dtype)
        if stored.space not in ("", *SPACES.values()) or stored.space == SPACES["gamma22"]:
            notes.append(
                f"the file's colour space is {stored.space}; its colours are read as {encoding}"
            )
        elif values.dtype.kind == "f" and stored.space == SPACES["srgb"] and colour is None:
            notes.append("the file's colour space is srgb, but floats are read as linear")
        values = _linear(values, encoding, len(chosen) in (2, 4))
        if encoding != "srgb":
            # The ICC profile describes another encoding than the one that will be written.
            kept = {
                name: stored.attributes[name]
                for name in KEPT_ATTRIBUTES
                if name in stored.attributes
            }
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
    """Return the indices of the colour and alpha channels, and the names of the others."""
    layers = {name.rpartition(".")[0] for name in names}
    # Remove the layer's name if all channels have the same one.
    plain = [name.rpartition(".")[2] if len(layers) == 1 else name for name in names]
    places = {name.upper(): index for index, name in reversed(list(enumerate(plain)))}
    alpha = [places[name] for name in ("A", "ALPHA") if name in places][:1]
    if {"R", "G", "B"} <= places.keys():
        chosen = [places["R"], places["G"], places["B"], *alpha]
    elif len(names) == 1 + len(alpha):
        chosen = [index for index in range(len(names)) if index not in alpha] + alpha
    else:
        raise ValueError(
            f"the channels {', '.join(names)} are not R, G, B or a single one, with or without "
            "alpha"
        )
    return chosen, [name for index, name in enumerate(names) if index not in chosen]


def _encoding_given_by(stored: StoredImage, dtype: np.dtype[Any]) -> Colour:
    return "linear" if dtype.kind == "f" or stored.space == SPACES["linear"] else "srgb"


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
    # A table with one entry per integer value, computed in float64.
    scale = np.iinfo(values.dtype).max
    plain = np.arange(scale + 1) / scale
    table = (decode_srgb(plain) if encoding == "srgb" else plain).astype(np.float32)
    decoded: NDArray[Any] = table[values]
    if has_alpha:
        decoded[:, :, colours:] = plain.astype(np.float32)[values[:, :, colours:]]
    return decoded
