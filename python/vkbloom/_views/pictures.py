"""Viewable pictures of arrays, as PNG and side by side in HTML."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.displayed import scale_to_1
from vkbloom._io.srgb import encode_srgb
from vkbloom._views import markup
from vkbloom._views.markup import element

#: The style of settings as code.
CODE = "color:inherit;background:none;padding:0;white-space:pre-wrap;overflow-wrap:anywhere"
_COLUMNS = "display:grid;gap:12px;grid-template-columns:repeat(auto-fill,minmax(200px,1fr))"
_THUMBNAIL_SIDE = 320  # pixels; keeps the page of a whole frame under about 1 MB


def thumbnail_size(array: NDArray[Any]) -> tuple[int, int]:
    """Return the size of a small picture of an image, at most its own."""
    height, width = array.shape[:2]
    return scale_size(width, height, min(1.0, _THUMBNAIL_SIDE / max(width, height)))


def thumbnails(shown: Iterable[tuple[str, NDArray[np.uint8], str]]) -> markup.Markup:
    """Return small pictures with their names and notes, side by side."""
    parts = []
    for name, pixels, note in shown:
        # Show the pixels of an enlarged pyramid level without smoothing.
        rendering = "auto" if max(pixels.shape[:2]) >= _THUMBNAIL_SIDE / 2 else "pixelated"
        style = "display:block;width:100%;height:auto;max-width:none;object-fit:contain;"
        style += f"image-rendering:{rendering};background:rgba(128,128,128,.15)"
        image = markup.image(png(pixels), f"{name}, {note}", style=style)
        caption = (element("b", name), " ", element("span", note, style="opacity:.7"))
        parts.append(markup.figure(image, *caption, style="margin:0"))
    return element("div", *parts, style=_COLUMNS)


def picture(
    array: NDArray[Any],
    name: str = "",
    *,
    encoding: str = "none",
    size: tuple[int, int] | None = None,
    stops: float = 0.0,
    expand: float = 1.0,
) -> NDArray[np.uint8]:
    """Convert an image to a viewable 8-bit picture.

    8-bit images are shown as stored. Float images are shown with the sRGB curve, unless `encoding`
    says that their colours have a curve; colours with a component above 1 are divided by the
    largest one, which keeps their hue, others are clipped to 0..1. Highlights that were expanded up
    to `expand` are compressed. `normal` is shown as
    (n + 1) / 2, `position` with each axis stretched to 0..1, depth from white (nearest) to black
    (farthest). NaN counts as 0.
    """
    values = np.atleast_3d(array).astype(np.float32)
    linear = False
    if array.dtype.kind == "u":
        shown = values / np.float32(np.iinfo(array.dtype).max)
    elif array.ndim == 2:
        shown = np.float32(1) - _stretch(values)
    elif name == "position":
        shown = _stretch(values)
    elif name == "normal":
        shown = _clip(values * np.float32(0.5) + np.float32(0.5))
    else:
        if stops != 0:
            values[:, :, :3] *= np.float32(2.0**stops)
        linear = encoding == "none"
        shown = _clip(scale_to_1(values, expand=expand) if linear else values)
    if size is not None:
        shown = resize(shown, *size)
    if linear:
        shown[:, :, :3] = encode_srgb(shown[:, :, :3])
    pixels: NDArray[np.uint8] = np.rint(shown * np.float32(255)).astype(np.uint8)
    return pixels


def _clip(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Clip to 0..1; NaN gives 0."""
    finite = np.nan_to_num(values, nan=0.0, posinf=1.0, neginf=0.0)
    return np.clip(finite, 0.0, 1.0)


def _stretch(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Map the finite range of each channel to 0..1; one value gives 0."""
    finite = np.isfinite(values)
    low: NDArray[np.float32] = values.min(axis=(0, 1), where=finite, initial=np.inf)
    high: NDArray[np.float32] = values.max(axis=(0, 1), where=finite, initial=-np.inf)
    # Stays positive if no value is finite and the range is inf to -inf.
    span = np.maximum(high - low, np.finfo(np.float32).tiny)
    return _clip((np.clip(values, low, high) - low) / span)


def scale_size(width: int, height: int, factor: float) -> tuple[int, int]:
    """Return a size times a factor; each side is at least one pixel."""
    return max(1, round(width * factor)), max(1, round(height * factor))


def resize(image: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Resize an (H, W, C) image: average groups of pixels to reduce, repeat pixels to enlarge."""
    for axis, wanted in ((0, height), (1, width)):
        count = image.shape[axis]
        starts = np.arange(wanted) * count // wanted
        if wanted < count:
            lengths = np.diff(starts, append=count).astype(np.float32)
            sums = np.add.reduceat(image, starts, axis=axis)
            image = sums / lengths.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        else:
            image = image.take(starts, axis=axis)
    return image


def reduce(image: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """Return an (H, W, C) image whose pixels are averaged until it fits into (width, height)."""
    height, width = image.shape[:2]
    shrink = min(size[0] / width, size[1] / height)
    if shrink >= 1:
        return image
    with np.errstate(invalid="ignore"):
        small = resize(image.astype(np.float32), *scale_size(width, height, shrink))
    return np.rint(small).astype(np.uint8) if image.dtype == np.uint8 else small.astype(image.dtype)


def png(
    pixels: NDArray[np.uint8], level: int = -1, texts: Mapping[str, str] = MappingProxyType({})
) -> bytes:
    """Encode a picture as PNG (W3C PNG specification).

    It lets notebooks show pictures with only NumPy installed; OpenImageIO writes the files that
    users save. `texts`: texts of the file in ASCII, by keyword.
    """
    height, width, channels = pixels.shape
    rows = pixels.reshape(height, width * channels)
    # Filter type 2, the difference to the row above, compresses smooth pictures far better.
    filtered = np.full((height, 1 + rows.shape[1]), 2, np.uint8)
    filtered[:, 1:] = rows
    filtered[1:, 1:] -= rows[:-1]
    colour_type = {1: 0, 3: 2, 4: 6}[channels]
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)),
        *((b"tEXt", f"{name}\0{text}".encode("ascii")) for name, text in texts.items()),
        (b"IDAT", zlib.compress(filtered.tobytes(), level)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
