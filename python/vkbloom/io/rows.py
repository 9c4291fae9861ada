"""Read and write files of large images by bands of rows, so that no memory holds all of them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from vkbloom.checks import import_extra
from vkbloom.io import image_reading, image_writing, safe_writing
from vkbloom.io.images import DTYPES, Picture, SavedColour, StoredImage, failure_of

if TYPE_CHECKING:
    import OpenImageIO

__all__ = ["RowReader", "opened_rows", "written_rows"]

# The most bytes of a band, as four single floats for each pixel.
_BAND_BYTES: Final = 64 << 20


class RowReader:
    """An open file, from the top to the bottom.

    Parameters
    ----------
    reader : OpenImageIO.ImageInput
    name : str
        The file's, for errors.

    Attributes
    ----------
    size : (int, int)
        Width and height in pixels.
    numbers : str
        OpenImageIO's name of the number type.
    band : int
        Rows to read at a time; the last band may have fewer.
    """

    def __init__(self, reader: OpenImageIO.ImageInput, name: str) -> None:
        self._reader = reader
        self._name = name
        self._empty = image_reading.describe(reader)
        reader.seek_subimage(0, 0)
        self._spec = spec = reader.spec()
        self.size = spec.width, spec.height
        self.numbers = str(spec.format)
        step = max(spec.tile_height, 1)
        rows = _BAND_BYTES // (16 * spec.width)
        self.band = max(rows // step, 1) * step

    def read(self, first: int, count: int) -> StoredImage:
        """Return rows as `image_reading.load` returns the image.

        Raises
        ------
        ValueError
            The file is damaged; the error names it.
        """
        spec = self._spec
        wanted = self.numbers if self.numbers != "double" else "float"
        y, place = spec.y + first, (0, 0)
        if spec.tile_width:
            columns = spec.x, spec.x + spec.width
            data = self._reader.read_tiles(
                *place, *columns, y, y + count, 0, 1, 0, spec.nchannels, wanted
            )
        else:
            data = self._reader.read_scanlines(*place, y, y + count, 0, 0, spec.nchannels, wanted)
        reason = failure_of(self._reader)
        if data is None or reason:
            raise ValueError(f"{self._name}: damaged: {reason or 'the pixels cannot be read'}")
        shape = count, spec.width, spec.nchannels
        pixels = np.asarray(data, DTYPES[self.numbers]).reshape(shape)
        return dataclasses.replace(self._empty, pixels=pixels)


@contextmanager
def opened_rows(path: str | os.PathLike[str]) -> Iterator[RowReader | None]:
    """Open a file to be read by rows; None where it has to be read as a whole.

    That are files with several parts, files that are turned, or whose data window is not their
    display window, and what `image_reading.load` refuses.

    Raises
    ------
    OSError, ValueError, ModuleNotFoundError
        As `image_reading.opened`.
    """
    name = os.fspath(path)
    with image_reading.opened(path, "Reading images") as reader:
        has_parts = reader.seek_subimage(1, 0)
        failure_of(reader)
        reader.seek_subimage(0, 0)
        spec = reader.spec()
        display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
        is_plain = (
            not has_parts
            and not spec.deep
            and spec.depth == 1
            and str(spec.format) in DTYPES
            and display == (spec.x, spec.y, spec.width, spec.height)
            and spec.get_int_attribute("Orientation", 1) == 1
        )
        if is_plain:
            image_reading.check_plausible(spec, name)
        yield RowReader(reader, name) if is_plain else None


@contextmanager
def written_rows(
    path: str | os.PathLike[str],
    height: int,
    colour: SavedColour | None,
    attributes: Mapping[str, str],
    quality: int | None,
) -> Iterator[Callable[[Picture], tuple[str, ...]]]:
    """Give a function that writes the next rows, and returns notes as `image_writing.save` does.

    The file is there when all are written.

    Parameters
    ----------
    path, colour, attributes, quality
        As for `image_writing.save`.
    height : int
        Rows in all.

    Raises
    ------
    OSError, ValueError
        As `image_writing.save`.
    """
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    target = Path(path)
    safe_writing.check_extension(oiio, target.suffix)
    image_writing.check_quality(target, quality)
    told: dict[str, str | int] = {**attributes}
    if quality is not None:
        told["CompressionQuality"] = quality
    temporary = safe_writing.reserve(target, 0)
    writer: Any = oiio.ImageOutput.create(str(temporary))
    layout: tuple[int, str] | None = None
    row = 0

    def check(done: bool) -> None:
        if not done:
            raise safe_writing.write_error(writer, temporary, target)

    def add(picture: Picture) -> tuple[str, ...]:
        nonlocal layout, row
        if layout is None:
            layout = image_writing.chosen_layout(oiio, picture, writer, temporary, target)
        values, encoding, notes = image_writing.prepared(picture, *layout, colour, target)
        described = dataclasses.replace(picture, encoding=encoding)
        if row == 0:
            shape = height, *values.shape[1:]
            spec = image_writing.spec_of(
                oiio,
                writer,
                shape,
                values.dtype,
                picture=described,
                target=target,
                attributes=told,
            )
            check(writer.open(str(temporary), spec))
        top = picture.stored.origin[1] if writer.supports("displaywindow") else 0
        rows = np.ascontiguousarray(values)
        check(writer.write_scanlines(top + row, top + row + len(rows), 0, rows))
        row += len(rows)
        return notes

    try:
        yield add
        check(writer.close())
        safe_writing.check_complete(oiio, temporary, target)
        safe_writing.put_in_place(temporary, target)
    finally:
        # Read, so that OpenImageIO does not print it.
        writer.geterror()
        temporary.unlink(missing_ok=True)
