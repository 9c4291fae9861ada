"""``vkbloom apply`` for pictures that are too large to be copied: by bands of rows."""

from __future__ import annotations

import dataclasses
import itertools
import json
from collections.abc import Generator, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, Final, NamedTuple

import click
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom
from vkbloom.banded import Band, BloomByBands, ImageByBands
from vkbloom.checks import check_emission, check_mask
from vkbloom.cli import no_bloom
from vkbloom.cli.glow_options import has_straight, premultiplied
from vkbloom.cli.image_files import decoded, not_of_bytes, note, note_parts, note_specials
from vkbloom.io.array_files import divided
from vkbloom.io.glows import alike, grey_mask
from vkbloom.io.images import Colour, Picture, SavedColour, StoredImage
from vkbloom.io.rows import Rows, opened_rows, written_rows

__all__ = ["Large", "apply_by_rows", "is_large"]

#: Pictures of this many pixels or more are processed in bands.
LARGE: Final = 1 << 24
#: Usual limit of an image's sides on devices. Longer pictures are processed in bands.
LONGEST_SIDE: Final = 1 << 14
#: 8-bit pictures of this many pixels or more become half floats, whose steps are finer.
HALVED: Final = 1 << 26


class Large(NamedTuple):
    """How pictures are read: the arguments of the command of these names.

    Attributes
    ----------
    mask, emission, layer : str or None
    subimage : int
    colour : str or None
        `input_colour`.
    raw : bool
    half : bool or None
        None: 8-bit files of `HALVED` pixels or more become half floats.
    expand : float or None
    """

    mask: str | None = None
    emission: str | None = None
    layer: str | None = None
    subimage: int = 0
    colour: Colour | None = None
    raw: bool = False
    half: bool | None = None
    expand: float | None = None


def is_large(path: str, subimage: int = 0, layer: str | None = None) -> bool:
    """Whether a file is processed in bands. False for a file that cannot be opened."""
    try:
        with opened_rows(path, subimage, layer) as rows:
            return rows.size[0] * rows.size[1] >= LARGE or max(rows.size) > LONGEST_SIDE
    except (OSError, ValueError):
        return False


def apply_by_rows(
    renderer: vkbloom.Renderer,
    source: str,
    target: Path,
    settings: vkbloom.Settings,
    how: Large,
    *,
    colour: SavedColour | None,
    quality: int | None,
    disable: bool | None,
) -> None:
    """Add bloom to a large picture, and write it.

    Parameters
    ----------
    renderer : Renderer
    source, target, colour, quality
        Arguments of the command.
    settings : Settings
    how : Large
    disable : bool, optional
        Whether to hide the progress bar. None: it is shown on a terminal.
    """
    is_blended = settings.alpha != "keep"
    reading = _Reading(source, how, is_blended)
    height = reading.height
    with ExitStack() as stack:
        bar = stack.enter_context(tqdm(total=2 * height, unit="row", leave=False, disable=disable))
        bands = stack.enter_context(closing(reading.bands()))
        first = next(bands)
        taken = itertools.chain([first], bands)
        count = min(len(first.image), LONGEST_SIDE // 4)
        bloom = BloomByBands.of(renderer._core, settings, first, height, count)
        if bloom is None:
            finals = _held_whole(renderer, settings, taken, height, bar)
        else:
            for count in bloom.reduce(taken):
                bar.update(count)
            if bloom.is_without:
                note(f"{source}: {no_bloom.reason(settings)}")
            finals = bloom.finals(stack.enter_context(closing(reading.bands())))
        facts = {
            "Software": f"vkbloom {vkbloom.__version__}",
            "vkbloom:settings": json.dumps(settings.to_dict()),
        }
        write = stack.enter_context(written_rows(target, height, colour, facts, quality))
        losses: dict[str, None] = {}
        for final in finals:
            picture = reading.result(final, settings)
            losses.update(dict.fromkeys(write(picture)))
            bar.update(len(final))
    for text in losses:
        note(text)


def _held_whole(
    renderer: vkbloom.Renderer,
    settings: vkbloom.Settings,
    bands: Iterator[Band],
    height: int,
    bar: tqdm[Any],
) -> Iterator[NDArray[Any]]:
    """Yield bands of `final` of an image that is complete on the device."""
    first = next(bands)
    image = ImageByBands(renderer._core, first, height, settings)
    bar.update(len(first.image))
    for band in bands:
        image.add(band)
        bar.update(len(band.image))
    for top in range(0, height, len(first.image)):
        yield image.final(top, min(len(first.image), height - top))


class _Reading:
    """A picture with its mask and its emission, which can be read several times.

    Parameters
    ----------
    source : str
    how : Large
    is_blended : bool
        Whether colours are multiplied by alpha.
    """

    def __init__(self, source: str, how: Large, is_blended: bool) -> None:
        self._source = source
        self._how = how
        self._is_blended = is_blended
        self._picture: Picture | None = None
        self._is_told = False
        with opened_rows(source, how.subimage, how.layer) as rows:
            self._size = rows.size
        if how.raw and rows.numbers != "uint8":
            raise not_of_bytes(source, rows.numbers)
        half = how.half
        if half is None:
            half = rows.numbers == "uint8" and rows.size[0] * rows.size[1] >= HALVED
        self._half = half and not how.raw

    @property
    def height(self) -> int:
        """Number of rows."""
        return self._size[1]

    def bands(self) -> Generator[Band]:
        """Yield bands from the top to the bottom; print notes at the end of the first reading."""
        how = self._how
        notes = [_Notes(file) for file in (self._source, how.emission or "", how.mask or "")]
        with ExitStack() as stack:
            rows = stack.enter_context(opened_rows(self._source, how.subimage, how.layer))
            emission, mask = (
                None if file is None else stack.enter_context(opened_rows(file))
                for file in (how.emission, how.mask)
            )
            for name, other in (("emission", emission), ("mask", mask)):
                if other is not None and other.size != self._size:
                    raise click.UsageError(
                        f"{name}: shape {other.size[::-1]} is not the image's, {self._size[::-1]}"
                    )
            for stored in rows.bands():
                picture = self._decoded(stored, how.colour, notes[0])
                if self._picture is None:
                    note_parts(self._source, stored, how.layer)
                    self._picture = dataclasses.replace(picture, pixels=picture.pixels[:1])
                yield self._band(picture.pixels, emission, mask, notes)
        if not self._is_told:
            self._is_told = True
            for one in notes:
                one.tell()

    def _band(
        self, image: NDArray[Any], emission: Rows | None, mask: Rows | None, notes: list[_Notes]
    ) -> Band:
        """Return rows of the image with the next rows of emission and mask."""
        glow = values = None
        if emission is not None:
            picture = self._decoded(emission.take(len(image)), self._how.colour, notes[1])
            glow = check_emission(alike(picture.pixels, image), image)
        if mask is not None:
            read = decoded(mask.take(len(image)), self._how.mask or "", "linear")
            notes[2].add(read)
            values = check_mask(grey_mask(read.pixels, self._how.mask or ""), image.shape[:2])
        return Band(image, glow, values)

    def _decoded(self, stored: StoredImage, colour: Colour | None, notes: _Notes) -> Picture:
        # Only the picture's own highlights are expanded, not those of an emission.
        expand = self._how.expand if notes.file == self._source else None
        picture = decoded(stored, notes.file, colour, raw=self._how.raw, expand=expand)
        notes.add(picture)
        if self._is_blended:
            picture = premultiplied(picture)
        if self._half and picture.pixels.dtype == np.float32:
            picture = dataclasses.replace(picture, pixels=picture.pixels.astype(np.float16))
        return picture

    def result(self, final: NDArray[Any], settings: vkbloom.Settings) -> Picture:
        """Return rows of `final` as a picture with the properties of the file."""
        assert self._picture is not None
        if self._is_blended and has_straight(self._picture):
            final = divided(final)
        done = self._picture.encoding if settings.encoding == "none" else settings.encoding
        return dataclasses.replace(self._picture, pixels=final, encoding=done)


class _Notes:
    """Notes about a picture, collected over all bands."""

    def __init__(self, file: str) -> None:
        self.file = file
        self._nan = self._infinite = 0
        self._texts: dict[str, None] = {}

    def add(self, picture: Picture) -> None:
        self._nan += int(np.isnan(picture.values).sum())
        self._infinite += int(np.isinf(picture.values).sum())
        self._texts.update(dict.fromkeys(picture.notes))

    def tell(self) -> None:
        note_specials(self.file, self._nan, self._infinite)
        for text in self._texts:
            note(f"{self.file}: {text}")
