"""OpenImageIO's readers: open a file, choose a part, and get its values.

A file is opened with the workarounds that readers need; their errors name the file.
"""

from __future__ import annotations

import itertools
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._c_paths import for_c, is_name
from vkbloom._extras import import_extra
from vkbloom._io.formats import jpeg_xl, photoshop, pnm
from vkbloom._io.formats.fits import SIGNED
from vkbloom._io.formats.tiff import LAB, RAW_ADVICE, full_picture, is_raw
from vkbloom._io.picture import DTYPES, NUMBERS_ADVICE, WITH_WINDOWS, Window, list_all

if TYPE_CHECKING:
    import OpenImageIO

# What to do with AVIF and HEIF.
_HEIF_ADVICE: Final = (
    "this OpenImageIO is built without libheif, which reads AVIF and HEIF; convert the file to "
    "PNG, HEIF by pillow-heif"
)
# Brands of ISO base media files: of ISO/IEC 23008-12 and of AVIF.
_HEIF_BRANDS: Final = b"avif avis heic heix hevc heim heis hevx mif1 msf1".split()
# Bytes of a file that say what it is.
_MIN_HEAD: Final = 32
_MAX_SIDE: Final = 65536
# Pixels of the largest texture, 16384 x 16384. A damaged header may claim more.
_MAX_AREA: Final = 1 << 28
# Above this size in bytes, the pixels must be plausible for the size of the file. Deflate, which
# PNG, TIFF and OpenEXR use, expands one byte to at most 1032 (RFC 1951: 258 bytes from two bits).
_LARGE: Final = 1 << 28
_MAX_RATIO: Final = 4096
# The most parts that are listed. Some files have thousands, and each takes time.
_MAX_PARTS: Final = 100
# libjpeg's warning about bytes after the pixels of a scan. Before a restart marker, 0xd0 to 0xd7,
# pixels were lost.
_EXTRA_BYTES: Final = re.compile(
    r"\AJPEG error: Corrupt JPEG data: (\d+) extraneous bytes before marker 0x(?!d[0-7])[^\n]*\Z"
)


def check_name(path: str | os.PathLike[str]) -> str:
    """Return a file name, which must be text."""
    if not isinstance(path, str | os.PathLike) or isinstance(name := os.fspath(path), bytes):
        raise TypeError(
            f"path: {path!r} is not a str or a path"
            + "; use os.fsdecode(path)" * isinstance(path, bytes)
        )
    if not is_name(name):
        encoding = sys.getfilesystemencoding()
        locale = "" if encoding == "utf-8" else f", nor {encoding}, the locale's encoding"
        raise ValueError(
            f"path: {name!r} is not UTF-8{locale}; rename the image file or its folder"
        )
    return name


class FilePart(NamedTuple):
    """A part of a file.

    - `number`: From 0.
    - `kept`: The channels of the layer to read.
    - `notes`: Notes for the user.
    """

    number: int
    spec: OpenImageIO.ImageSpec
    kept: list[int]
    notes: list[str]


@contextmanager
def open_image(path: str | os.PathLike[str], purpose: str) -> Iterator[OpenImageIO.ImageInput]:
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
        if reader is None:
            if is_raw(name):
                raise ValueError(f"{name}: is {RAW_ADVICE}")
            reason = _HEIF_ADVICE if _is_heif(name) else reason or "unknown format"
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
    return reader is not None and reader.format_name() == "psd" and photoshop.is_grey(name)


@contextmanager
def readable(path: str | os.PathLike[str]) -> Iterator[str]:
    """Yield a file to open in place of a file, which is a copy where OpenImageIO needs another one.

    These are some files of JPEG XL, and plain PBM.
    """
    name, content, suffix = os.fspath(path), None, ".jxl"
    head = _head_of(name) if os.path.isfile(name) else b""
    if head.startswith(jpeg_xl.SIGNATURES):
        content = jpeg_xl.readable_content(name)
    elif head.startswith(pnm.PLAIN):
        content, suffix = pnm.pack_bitmap(name), ".pbm"
    if content is None:
        yield name
        return
    with tempfile.NamedTemporaryFile(suffix=suffix) as file:
        file.write(content)
        file.flush()
        yield file.name


def _head_of(name: str) -> bytes:
    with open(name, "rb") as stream:
        return stream.read(_MIN_HEAD)


def _is_heif(name: str) -> bool:
    """Whether a file is AVIF or HEIF."""
    head = _head_of(name)
    return head[4:8] == b"ftyp" and head[8:12] in _HEIF_BRANDS


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
    if size > max(_LARGE, _MAX_RATIO * os.path.getsize(path)):
        raise ValueError(
            f"{os.fspath(path)}: damaged: {os.path.getsize(path)} bytes cannot hold "
            f"{spec.width} x {spec.height} pixels"
        )


def choose_part(
    reader: OpenImageIO.ImageInput, name: str, subimage: int, layer: str | None
) -> FilePart:
    """Make the part to read the current one; ValueError if it is not supported."""
    notes: list[str] = []
    if reader.format_name() == "tiff":
        full, said = full_picture(name)
        if layer is None and subimage == 0:
            subimage = full
            notes += [] if said is None else [said]
    if layer is not None:
        subimage = _part_with(reader, name, subimage, layer)
    if subimage < 0 or not _seek(reader, subimage):
        count = sum(1 for _ in _parts(reader))
        raise ValueError(f"{name}: subimage {subimage} is not in 0..{count - 1}")
    spec = reader.spec()
    if spec.width < 1 or spec.height < 1:
        more = f"; subimage {subimage + 1} is another" if _seek(reader, subimage + 1) else ""
        raise ValueError(f"{name}: there are no pixels in this part of the file{more}")
    _check_readable(spec, reader.format_name(), name)
    kept = [index for index, part in enumerate(_layers_of(spec)) if layer in (None, part)]
    return FilePart(subimage, spec, kept, notes)


def _seek(reader: OpenImageIO.ImageInput, subimage: int) -> bool:
    """Make a part the current one, if there is such a part."""
    is_there: bool = reader.seek_subimage(subimage, 0)
    if not is_there:
        # Some readers leave an error, which would be taken for damaged pixels.
        failure_of(reader)
    return is_there


def _check_readable(spec: OpenImageIO.ImageSpec, kind: str, name: str) -> None:
    """Raise ValueError for a part that is not supported, or that its file cannot hold."""
    if spec.deep or spec.depth > 1:
        raise ValueError(f"{name}: a deep image or a volume is not supported; use a flat image")
    # (FITS scales signed numbers.)
    if str(spec.format) not in {**DTYPES, **(SIGNED if kind == "fits" else {})}:
        raise ValueError(f"{name}: {NUMBERS_ADVICE.format(spec.format)}")
    if kind == "tiff" and str(spec.format) == "double" and spec.tile_width:
        # OpenImageIO 3.2 returns memory that it has not written.
        raise ValueError(f"{name}: tiles of doubles are not supported; use strips, or floats")
    width, height = _union_size(spec) if kind in WITH_WINDOWS else (spec.width, spec.height)
    if max(width, height) > _MAX_SIDE or width * height > _MAX_AREA:
        raise ValueError(
            f"{name}: {width} x {height} is larger than {_MAX_SIDE} pixels on a side or "
            f"{_MAX_AREA} in all"
        )
    check_plausible(spec, name)


def read_values(
    reader: OpenImageIO.ImageInput, spec: OpenImageIO.ImageSpec, name: str, part: int
) -> tuple[NDArray[Any], list[str]]:
    """Return the values (H, W, C) of a part of a file as the reader gives them, and notes."""
    wanted = str(spec.format) if str(spec.format) != "double" else "float"
    data = reader.read_image(part, 0, 0, spec.nchannels, wanted)
    notes = _warnings_of(reader, name)
    dtype = {**DTYPES, **SIGNED}[str(spec.format)]
    pixels = np.asarray(complete(data, reader, name), dtype)
    return pixels.reshape(spec.height, spec.width, spec.nchannels), notes


def place_upright(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec, kind: str, orientation: int
) -> tuple[NDArray[Any], tuple[int, int], Window]:
    """Return the pixels upright, the origin and the display window.

    The pixels of OpenEXR cover both windows. Positions of other formats are those on a page, which
    do not move the picture.
    """
    origin, display = (0, 0), (0, 0, pixels.shape[1], pixels.shape[0])
    if kind in WITH_WINDOWS:
        pixels, origin, display = _in_windows(pixels, spec)
    if orientation == 1:
        return pixels, origin, display
    x, y = display[0] - origin[0], display[1] - origin[1]
    pixels = _upright(pixels[y : y + display[3], x : x + display[2]], orientation)
    return pixels, (0, 0), (0, 0, pixels.shape[1], pixels.shape[0])


def _in_windows(
    pixels: NDArray[Any], spec: OpenImageIO.ImageSpec
) -> tuple[NDArray[Any], tuple[int, int], Window]:
    """Return the pixels of the data window and the display window, the origin, and the latter."""
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    left, top = min(spec.x, display[0]), min(spec.y, display[1])
    width, height = _union_size(spec)
    if pixels.shape[:2] != (height, width):
        row, column = spec.y - top, spec.x - left
        whole = np.zeros((height, width, spec.nchannels), pixels.dtype)
        whole[row : row + spec.height, column : column + spec.width] = pixels
        pixels = whole
    return pixels, (left, top), display


def _union_size(spec: OpenImageIO.ImageSpec) -> tuple[int, int]:
    """Return the size of the area of the data window and the display window."""
    right = max(spec.x + spec.width, spec.full_x + spec.full_width)
    bottom = max(spec.y + spec.height, spec.full_y + spec.full_height)
    return right - min(spec.x, spec.full_x), bottom - min(spec.y, spec.full_y)


def _upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Undo an orientation of TIFF 6.0 and Exif, 1 to 8: the sides of the first row and column."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def _layers_of(spec: OpenImageIO.ImageSpec) -> list[str]:
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
        layers = _layers_of(spec)
        if layer in layers:
            return index
        known.update(dict.fromkeys(filter(None, layers)))
    said = f"its layers are {list_all(known)}" if known else "it has no named layers"
    raise ValueError(f"{name}: there is no layer {layer!r}; {said}")


def _parts(reader: OpenImageIO.ImageInput, first: int = 0) -> Iterator[OpenImageIO.ImageSpec]:
    """Make each part the current one, and yield what it is."""
    for index in itertools.count(first):
        if not _seek(reader, index):
            return
        yield reader.spec()


def names_of_parts(reader: OpenImageIO.ImageInput) -> tuple[str, ...]:
    """Return the names of a file's first parts; the reader goes to other parts."""
    return tuple(map(_name_of, itertools.islice(_parts(reader), _MAX_PARTS)))


def complete(pixels: NDArray[Any] | None, reader: Any, file: object) -> NDArray[Any]:
    """Return the pixels that a reader gave, or raise ValueError if the file is damaged."""
    # A truncated JPEG has pixels and an error.
    reason = failure_of(reader)
    if pixels is None or reason:
        raise ValueError(f"{file}: damaged: {reason or 'the pixels cannot be read'}")
    return pixels


def _warnings_of(reader: Any, file: object) -> list[str]:
    """Return notes about warnings that a reader has left, or raise ValueError for an error."""
    reason = failure_of(reader)
    if (extra := _EXTRA_BYTES.search(reason)) is not None:
        return [f"{extra[1]} bytes of the file belong to no pixel and are ignored"]
    if reason:
        raise ValueError(f"{file}: damaged: {reason}")
    return []


def failure_of(source: Any) -> str:
    """Return and clear the error of an OpenImageIO object in one line; "" if there is none."""
    try:
        text: str = source.geterror()
    except UnicodeDecodeError as error:
        # The message quotes bytes of a damaged file.
        text = error.object.decode(errors="replace")
    return "; ".join(dict.fromkeys(filter(None, map(str.strip, text.splitlines()))))
