"""Alpha of image files: what OpenImageIO's readers return, and what the files mean.

The readers are asked not to convert anything, so colours come as they are stored, with exceptions:

============================== ============================ ======================================
format                         the reader returns           the file means
============================== ============================ ======================================
OpenEXR                        as stored                    light times alpha; straight colours
                                                            with ``oiio:UnassociatedAlpha``
TIFF, ExtraSamples 1           as stored                    integers: encoded colours times alpha;
                                                            floats: light times alpha
TIFF, ExtraSamples 2 or none   as stored                    straight colours
TIFF, ExtraSamples 0           a channel without a name     no alpha
Targa 2.0, attributes type     as stored                    0, 1: no alpha; 2, 3: straight colours;
                                                            4: encoded colours times alpha
BMP with masks                 the bytes, whatever their    straight colours, if the mask of alpha
                               masks are                    is not 0
BMP of 32 bits without masks,  as stored                    straight colours; but where alpha is 0
ICO, Targa without a type,                                  everywhere, it means nothing
DDS without an alpha mode
DDS DXT2, DXT4                 colours divided by alpha     encoded colours times alpha
DDS with an alpha mode         as stored                    1: straight; 2: encoded colours times
                                                            alpha; 3, 4: no alpha
JPEG 2000, channel definition  as stored                    0, 1: straight; 2: encoded colours
                                                            times alpha
JPEG XL, alpha channel         as stored                    straight, or encoded colours times alpha
PSD of grey, all layers        as stored                    colours over white; without its share,
                                                            encoded colours times alpha
PSD of RGB, all layers         straight colours             the same
JPEG (Ultra HDR)               1                            no alpha
all others                     as stored                    straight colours
============================== ============================ ======================================

Encoded colours are divided by alpha before they are decoded.
"""

from __future__ import annotations

import enum
import os
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import saturate
from vkbloom._io.images import failure_of
from vkbloom._io.jpeg_xl import header_of
from vkbloom._io.narrowing import narrowed
from vkbloom._io.tiff import tiff_field

if TYPE_CHECKING:
    import OpenImageIO

# ExtraSamples of TIFF 6.0, and its value for colours that are multiplied by alpha.
_EXTRA_SAMPLES: Final = 338
_ASSOCIATED: Final = 1
# BMP's compressions whose pixels have masks: BI_BITFIELDS, BI_ALPHABITFIELDS.
_WITH_MASKS: Final = (3, 6)
# Bytes that are looked at for JPEG 2000's boxes before the pixels.
_HEADER_BYTES: Final = 1 << 16
# Formats in which two channels are grey and alpha; OpenImageIO calls them red and green.
_GREY_AND_ALPHA: Final = ("targa", "sgi", "jpeg2000", "jpegxl", "pnm", "psd", "rla", "fits")
# White is 0, black is 0 (TIFF 6.0, PhotometricInterpretation).
_GREY: Final = (0, 1)
# Hidden light of less than this share of the visible light does not show.
_TRIFLE: Final = 0.05


class Meaning(enum.Enum):
    """What alpha is to the colours of a file."""

    STRAIGHT = enum.auto()
    MULTIPLIED = enum.auto()
    NONE = enum.auto()


def channels_of(spec: OpenImageIO.ImageSpec, kind: str) -> tuple[str, ...]:
    """Return the names of the channels."""
    names = tuple(spec.channelnames)
    if kind == "tiff" and spec.get_int_attribute("tiff:PhotometricInterpretation", 2) in _GREY:
        # OpenImageIO calls further samples green and blue.
        alpha = spec.alpha_channel
        more = range(1, len(names))
        return "Y", *("A" if index == alpha else f"channel{index}" for index in more)
    if kind == "psd" and names[0] == "I":
        return "Y", *names[1:]
    return ("Y", "A") if names[:2] == ("R", "G") == names and kind in _GREY_AND_ALPHA else names


def meaning_of(
    reader: OpenImageIO.ImageInput, spec: OpenImageIO.ImageSpec, path: str | os.PathLike[str]
) -> Meaning:
    """Return what alpha means in the current part of a file. `spec`: of that part."""
    kind = reader.format_name()
    if kind == "openexr":
        # Alpha of a layer has another name.
        is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha")
        return Meaning.STRAIGHT if is_straight else Meaning.MULTIPLIED
    if "A" not in channels_of(spec, kind):
        return Meaning.STRAIGHT
    stated: Meaning | None = Meaning.STRAIGHT
    with open(path, "rb") as stream:
        match kind:
            case "jpeg":
                stated = Meaning.NONE
            case "tiff":
                extra = tiff_field(stream, _EXTRA_SAMPLES, reader.current_subimage())
                if extra is not None and [*extra[extra != 0][:1]] == [_ASSOCIATED]:
                    stated = Meaning.MULTIPLIED
            case "targa":
                stated = _of_targa(stream)
            case "bmp":
                stated = _of_bmp(path)
            case "dds":
                stated = _of_dds(stream)
            case "jpeg2000":
                stated = _of_jpeg_2000(stream)
            case "jpegxl":
                is_multiplied = header_of(path).is_multiplied
                stated = Meaning.MULTIPLIED if is_multiplied else Meaning.STRAIGHT
            case "ico":
                stated = None
    if stated is None:
        return Meaning.NONE if _is_0_everywhere(reader, spec) else Meaning.STRAIGHT
    return stated


def _is_0_everywhere(reader: OpenImageIO.ImageInput, spec: OpenImageIO.ImageSpec) -> bool:
    last = spec.nchannels - 1
    alpha = reader.read_image(reader.current_subimage(), 0, last, last + 1, spec.format)
    # The pixels are damaged if they cannot be read: they are read again.
    failure_of(reader)
    return alpha is not None and not alpha.any()


def _of_bmp(path: str | os.PathLike[str]) -> Meaning | None:
    masks = bmp_masks(path)
    if masks is None:
        return None
    return Meaning.STRAIGHT if masks[3] else Meaning.NONE


def _of_targa(stream: BinaryIO) -> Meaning | None:
    """Return the attributes type of the extension area (Truevision TGA 2.0, field 24)."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(size - 26, 0))
    footer = stream.read(26)
    start = int.from_bytes(footer[:4], "little")
    if footer[8:24] != b"TRUEVISION-XFILE" or not start:
        return None
    stream.seek(start)
    area = stream.read(495)
    if len(area) < 495:
        return None
    return {0: Meaning.NONE, 1: Meaning.NONE, 4: Meaning.MULTIPLIED}.get(
        area[494], Meaning.STRAIGHT
    )


def _of_dds(stream: BinaryIO) -> Meaning | None:
    """Return the alpha mode of the DX10 header (DDS_HEADER_DXT10, miscFlags2)."""
    header = stream.read(148)
    mode = header[144] & 7 if header[84:88] == b"DX10" and len(header) == 148 else 0
    known = (None, Meaning.STRAIGHT, Meaning.MULTIPLIED, Meaning.NONE, Meaning.NONE)
    return known[mode] if mode < len(known) else None


def _of_jpeg_2000(stream: BinaryIO) -> Meaning:
    """Return the type of the channel definition box (ISO/IEC 15444-1, I.5.3.6)."""
    header = stream.read(_HEADER_BYTES)
    start = header.find(b"cdef") + 4
    if start >= 4:
        count = int.from_bytes(header[start : start + 2], "big")
        for at in range(start + 2, min(start + 2 + 6 * count, len(header) - 5), 6):
            if header[at + 2 : at + 4] == b"\0\2":
                return Meaning.MULTIPLIED
    return Meaning.STRAIGHT


def bmp_masks(path: str | os.PathLike[str]) -> tuple[int, ...] | None:
    """Return the masks of red, green, blue and alpha of a BMP file of 32 bits, if it has them."""
    with open(path, "rb") as stream:
        head = stream.read(70)
    size, compression = (int.from_bytes(head[at : at + 4], "little") for at in (14, 30))
    if compression not in _WITH_MASKS or size < 40:
        return None
    count = 4 if size >= 56 or compression == _WITH_MASKS[1] else 3
    masks = tuple(
        int.from_bytes(head[at : at + 4], "little") for at in range(54, 54 + 4 * count, 4)
    )
    return (*masks, 0)[:4] if all(masks[:3]) else None


def multiplied(values: NDArray[Any]) -> NDArray[Any]:
    """Return colours multiplied by alpha, in the same dtype."""
    return _with_alpha(values, values[:, :, -1:])


def divided(values: NDArray[Any]) -> NDArray[Any]:
    """Return colours divided by alpha, in the same dtype; unchanged where alpha is 0."""
    alpha = values[:, :, -1:].astype(np.float32)
    unit = np.float32(1 if values.dtype.kind == "f" else np.iinfo(values.dtype).max)
    return _with_alpha(
        values, np.where(alpha == 0, unit, unit * unit / np.where(alpha, alpha, unit))
    )


def _with_alpha(values: NDArray[Any], factor: NDArray[Any]) -> NDArray[Any]:
    """Return values with colours times a factor; for integers, times factor / largest value."""
    made = values.astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        made[:, :, :-1] *= factor
    if values.dtype.kind == "u":
        largest = np.iinfo(values.dtype).max
        made[:, :, :-1] = np.rint(np.minimum(made[:, :, :-1] / largest, largest))
        return made.astype(values.dtype)
    # Colours divided by a small alpha may be beyond the range of their type.
    return narrowed(saturate(made, np.isfinite(values)), values.dtype)


def light_of(values: NDArray[Any]) -> tuple[float, float]:
    """Return the sum of colours where alpha is 0, and that of the others."""
    hidden, total = (_sum_of(pixels) for pixels in (values[values[:, :, 3] == 0], values))
    return hidden, total - hidden


def _sum_of(pixels: NDArray[Any]) -> float:
    colours = pixels[..., :3]
    is_light = (colours > 0) & (colours < np.inf)
    return float(np.sum(colours, where=is_light, dtype=np.float64))


def hidden_notes(hidden: float, visible: float) -> tuple[str, ...]:
    """Return a note about light where alpha is 0, as `Picture` has both, if it is no trifle."""
    if hidden <= _TRIFLE * visible:
        return ()
    share = 100 * hidden / (hidden + visible)
    return (
        f"{share:.0f} % of its light lie where alpha is 0, and bloom like the visible ones; "
        'premultiplied colours with alpha "blur" (--alpha blur) leave them out',
    )
