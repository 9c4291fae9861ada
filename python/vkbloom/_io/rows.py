"""Read and write files of large images by bands of rows, so that no memory holds all of them."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._checks import import_extra
from vkbloom._io import displayed, image_reading, image_writing, safe_writing
from vkbloom._io.alpha import in_order
from vkbloom._io.displayed import Saved
from vkbloom._io.images import DTYPES, Picture, StoredImage, complete, warnings_of

if TYPE_CHECKING:
    import OpenImageIO

__all__ = ["Rows", "opened_rows", "written_rows"]

# The most bytes of a band, as four single floats for each pixel.
_BAND_BYTES: Final = 64 << 20


class Rows:
    """The rows of an image file, from the top to the bottom.

    - `size`: Width and height in pixels.
    - `numbers`: OpenImageIO's name of the number type.
    - `read`: Returns rows `first` to `end` as `image_reading.load` returns the image.
    - `step`: `first` and `end` are multiples of this, or `end` is the height.
    - `band`: Rows to take at a time.
    """

    def __init__(
        self,
        size: tuple[int, int],
        numbers: str,
        read: Callable[[int, int], StoredImage],
        step: int = 1,
    ) -> None:
        self.size = size
        self.numbers = numbers
        self.band = max(_BAND_BYTES // (16 * size[0]) // step, 1) * step
        self._read = read
        self._place = 0
        self._left: StoredImage | None = None

    def take(self, count: int) -> StoredImage:
        """Return the next rows."""
        height = self.size[1]
        parts = [] if self._left is None else [self._left.pixels]
        found = self._left
        while found is None or (sum(map(len, parts)) < count and self._place < height):
            end = min(self._place + self.band, height)
            found = self._read(self._place, end)
            parts.append(found.pixels)
            self._place = end
        pixels = parts[0] if len(parts) == 1 else np.concatenate(parts)
        self._left = replace(found, pixels=pixels[count:])
        return replace(found, pixels=pixels[:count])

    def bands(self) -> Iterator[StoredImage]:
        """Yield all rows."""
        for first in range(0, self.size[1], self.band):
            yield self.take(min(self.band, self.size[1] - first))


@contextmanager
def opened_rows(
    path: str | os.PathLike[str], subimage: int = 0, layer: str | None = None
) -> Iterator[Rows]:
    """Open a file to be read by rows.

    Files that are turned, and those whose data window is not their display window, are read as a
    whole when the first rows are taken.
    """
    name = os.fspath(path)
    with image_reading.opened(path, "Reading images") as reader:
        subimage, spec = image_reading.chosen_part(reader, name, subimage, layer)
        orientation = spec.get_int_attribute("Orientation", 1)
        display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
        if orientation != 1 or display != (spec.x, spec.y, spec.width, spec.height):
            width, height = image_reading.size_of(spec)
            size = (height, width) if orientation > 4 else (width, height)
            whole = functools.cache(lambda: image_reading.load(name, subimage, layer))
            yield Rows(size, str(spec.format), lambda first, end: _cut(whole(), first, end))
            return
        empty = image_reading.describe(reader, name)
    # WebP's reader does not come back from other parts.
    with image_reading.opened(path, "Reading images") as reader:
        image_reading.chosen_part(reader, name, subimage, None)

        def read(first: int, end: int) -> StoredImage:
            pixels, notes = _read_rows(reader, name, subimage, first, end)
            notes = [*dict.fromkeys((*empty.notes, *notes))]
            found = replace(empty, pixels=pixels, notes=tuple(notes))
            return image_reading.of_layer(found, spec, layer)

        size = spec.width, spec.height
        yield Rows(size, str(spec.format), read, max(spec.tile_height, 1))


def _cut(stored: StoredImage, first: int, end: int) -> StoredImage:
    return replace(stored, pixels=stored.pixels[first:end])


def _read_rows(
    reader: OpenImageIO.ImageInput,
    name: str,
    subimage: int,
    first: int,
    end: int,
) -> tuple[NDArray[Any], list[str]]:
    """Return rows of the current part, which has that number, and notes."""
    spec = reader.spec()
    numbers = str(spec.format)
    wanted = numbers if numbers != "double" else "float"
    y, place = spec.y, (subimage, 0)
    if spec.tile_width:
        columns = spec.x, spec.x + spec.width
        data = reader.read_tiles(
            *place, *columns, y + first, y + end, 0, 1, 0, spec.nchannels, wanted
        )
    else:
        data = reader.read_scanlines(*place, y + first, y + end, 0, 0, spec.nchannels, wanted)
    notes = warnings_of(reader, name)
    data = complete(data, reader, name)
    pixels = np.asarray(data, DTYPES[numbers]).reshape(end - first, spec.width, spec.nchannels)
    return in_order(pixels, reader.format_name(), name), notes


@contextmanager
def written_rows(
    path: str | os.PathLike[str],
    height: int,
    saved: Saved,
    attributes: Mapping[str, str],
    quality: int | None,
    *,
    bits: int | None,
) -> Iterator[Callable[[Picture], tuple[str, ...]]]:
    """Yield a function that writes the next rows, and returns notes as `image_writing.save` does.

    The file is created or replaced when all rows are written.
    """
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    target = Path(path)
    safe_writing.check_extension(oiio, target.suffix)
    image_writing.check_quality(target, quality)
    image_writing.check_bits(target, bits)
    displayed.check_saved(saved)
    told: dict[str, str | int] = {**attributes}
    if quality is not None:
        told["CompressionQuality"] = quality
    layout: tuple[int, str] | None = None
    row = 0

    def add(picture: Picture) -> tuple[str, ...]:
        nonlocal layout, row
        picture = image_writing.in_colour(picture, saved)
        if layout is None:
            layout = image_writing.chosen_layout(
                oiio, picture, target, is_hdr=displayed.is_hdr(saved), bits=bits
            )
        values, described, notes = image_writing.prepared(oiio, picture, layout, saved, target)
        if row == 0:
            # Of the size of the image, without its memory.
            whole = np.broadcast_to(values[:1], (height, *values.shape[1:]))
            part = image_writing.Part(whole, described, told)
            spec = image_writing.spec_of(oiio, writer, part, target)
            check(writer.open(str(temporary), spec))
        top = picture.stored.origin[1] if writer.supports("displaywindow") else 0
        rows = np.ascontiguousarray(values)
        check(writer.write_scanlines(top + row, top + row + len(rows), 0, rows))
        row += len(rows)
        return notes

    with safe_writing.writing(oiio, target) as (writer, temporary, check):
        yield add
