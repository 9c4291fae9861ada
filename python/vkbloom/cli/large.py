"""``vkbloom apply`` of pictures that are too large to be held several times: by bands of rows."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import numpy as np
from tqdm import tqdm

import vkbloom
from vkbloom.banded import BandedImage
from vkbloom.cli.image_files import note
from vkbloom.io.images import Picture, SavedColour, StoredImage
from vkbloom.io.rows import RowReader, opened_rows, written_rows

__all__ = ["apply_by_rows", "is_large"]

#: Pixels from which on a picture is taken by rows.
LARGE: Final = 1 << 24
#: Pixels from which on a file of 8 bits becomes half floats, whose steps are finer than its own.
HALVED: Final = 1 << 26


def is_large(path: str) -> bool:
    """Whether a file is read by rows; a file that cannot be opened is not."""
    try:
        with opened_rows(path) as rows:
            return rows is not None and rows.size[0] * rows.size[1] >= LARGE
    except (OSError, ValueError):
        return False


def apply_by_rows(
    renderer: vkbloom.Renderer,
    source: str,
    target: Path,
    settings: vkbloom.Settings,
    *,
    decode: Callable[[StoredImage], Picture],
    half: bool | None,
    colour: SavedColour | None,
    quality: int | None,
    disable: bool | None,
) -> None:
    """Give a large picture bloom, and write it.

    Parameters
    ----------
    renderer : Renderer
    source, target, colour, quality
        As for the command.
    settings : Settings
    decode : callable
        Makes a picture of rows as they are stored.
    half : bool, optional
        Whether floats become half floats; by default those of files of 8 bits from `HALVED` pixels
        on.
    disable : bool, optional
        Of the progress bar; None: shown on a terminal.
    """
    with ExitStack() as stack:
        rows = stack.enter_context(opened_rows(source))
        if rows is None:
            raise ValueError(f"{source}: has changed while it was read")
        width, height = rows.size
        if half is None:
            half = rows.numbers == "uint8" and width * height >= HALVED
        bar = stack.enter_context(tqdm(total=2 * height, unit="row", leave=False, disable=disable))
        notes = _Notes(source)
        image: BandedImage | None = None
        first: Picture | None = None
        for picture in _bands(rows, decode):
            notes.add(picture)
            pixels = picture.pixels
            if half and pixels.dtype == np.float32:
                pixels = pixels.astype(np.float16)
            if image is None or first is None:
                first = dataclasses.replace(picture, pixels=pixels[:1])
                image = BandedImage(renderer._core, pixels, height)
            else:
                image.add(pixels)
            bar.update(len(pixels))
        assert image is not None
        assert first is not None
        notes.tell()
        facts = {
            "Software": f"vkbloom {vkbloom.__version__}",
            "vkbloom:settings": json.dumps(settings.to_dict()),
        }
        write = stack.enter_context(written_rows(target, height, colour, facts, quality))
        done = first.encoding if settings.encoding == "none" else settings.encoding
        losses: dict[str, None] = {}
        for top in range(0, height, rows.band):
            final = image.final(settings, top, min(rows.band, height - top))
            losses.update(
                dict.fromkeys(write(dataclasses.replace(first, pixels=final, encoding=done)))
            )
            bar.update(len(final))
    for text in losses:
        note(text)


def _bands(rows: RowReader, decode: Callable[[StoredImage], Picture]) -> Iterator[Picture]:
    height = rows.size[1]
    for top in range(0, height, rows.band):
        yield decode(rows.read(top, min(rows.band, height - top)))


class _Notes:
    """What is to be said of a picture, of all bands once."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._nan = self._infinite = 0
        self._texts: dict[str, None] = {}

    def add(self, picture: Picture) -> None:
        self._nan += int(np.isnan(picture.values).sum())
        self._infinite += int(np.isinf(picture.values).sum())
        self._texts.update(dict.fromkeys(picture.notes))

    def tell(self) -> None:
        if self._nan or self._infinite:
            note(
                f"{self._source} has {self._nan} NaN and {self._infinite} infinite values; the "
                "bloom counts them as 0, and their own pixels keep them"
            )
        for text in self._texts:
            note(f"{self._source}: {text}")
