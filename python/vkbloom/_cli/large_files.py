"""Bloom of picture files, by bands of rows: files may be larger than the memory."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import FUNCTION, checked_as
from vkbloom._checks import check_emission, check_mask
from vkbloom._cli import no_bloom
from vkbloom._cli.bands import Band, BloomByBands, ImageByBands
from vkbloom._io import image_reading, image_writing
from vkbloom._io.alpha import divided, hidden_notes
from vkbloom._io.array_files import has_straight, premultiplied
from vkbloom._io.displayed import Saved, check_saved
from vkbloom._io.glows import alike, grey_mask
from vkbloom._io.images import Colour, Picture, SavedColour, StoredImage
from vkbloom._io.rows import Rows, opened_rows, written_rows
from vkbloom._renderer.frame_files import settings_facts
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.registry import presets
from vkbloom._settings.settings import Settings, check_settings

if TYPE_CHECKING:
    from vkbloom import _core

__all__ = ["apply_file", "finished", "is_large"]

#: Pictures of this many pixels or more are processed in bands.
LARGE: Final = 1 << 24
#: Usual limit of an image's sides on devices. Longer pictures are processed in bands.
LONGEST_SIDE: Final = 1 << 14
#: 8-bit pictures of this many pixels or more become half floats, whose steps are finer.
HALVED: Final = 1 << 26


def is_large(path: str, subimage: int = 0, layer: str | None = None) -> bool:
    """Whether a file is processed in bands. False for a file that cannot be opened."""
    try:
        with opened_rows(path, subimage, layer) as rows:
            return rows.size[0] * rows.size[1] >= LARGE or max(rows.size) > LONGEST_SIDE
    except (OSError, ValueError):
        return False


@checked_as(progress=FUNCTION)
def apply_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    settings: Settings | None = None,
    *,
    renderer: Renderer | None = None,
    mask: str | os.PathLike[str] | None = None,
    emission: str | os.PathLike[str] | None = None,
    layer: str | None = None,
    subimage: int | None = None,
    input_colour: Colour | None = None,
    output_colour: SavedColour | None = None,
    primaries: str = "rec709",
    view: str | None = None,
    raw: bool = False,
    half: bool | None = None,
    bits: int | None = None,
    expand: float | None = None,
    quality: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[str, ...]:
    """Add bloom to an image file, and write the result to another file.

    The file is read, rendered and written in bands of rows. So it may be larger than the memory,
    and larger than an image of the device. The result is that of `Renderer.apply` for the complete
    image, bit by bit on a CPU. Where the bloom reaches too far for bands, the device holds the
    complete image. With ``alpha`` "max" and "blur", straight colours are multiplied by alpha first,
    and divided by it afterwards.

    Parameters
    ----------
    source, target : str or path-like
        Files of any format that OpenImageIO reads and writes. `target` is replaced when the new
        file is complete. It has the number type of `source`, or the closest one of its format.
    settings : Settings, optional
        Default: ``presets["bevy_natural"]``.
    renderer : Renderer, optional
        Default: a renderer of its own.
    mask, emission : str or path-like, optional
        Files of the image's size, as for `Renderer.apply`.
    layer : str, optional
        The layer to read of an OpenEXR file.
    subimage : int, optional
        The part to read of a file with several parts. Default: the first, with a note.
    input_colour : str, optional
        "linear", "srgb" or a colour space of OpenColorIO's built-in configuration. Default: that of
        the file, as for `read`.
    output_colour : {"linear", "srgb", "gamma22", "pq", "hlg"}, optional
        Encoding of the written colours. Default: "srgb" for integers, "linear" for floats. "pq" and
        "hlg" are written with 16 bits where the format has them.
    primaries : {"rec709", "rec2020", "p3"}
        Primaries of the written colours, as for `write`.
    view : str, optional
        A view instead of `output_colour` and `primaries`, as for `write`.
    raw : bool, default False
        Whether to use the values of an 8-bit file without decoding and encoding them.
    half : bool, optional
        Whether to hold floats in half the memory, as half floats. Default: 8-bit files of 64
        million pixels or more.
    bits : {8, 16, 32}, optional
        Size of a number in `target`. Default: that of `source`, or the closest one of the format.
    expand : float, optional
        What the highlights of a file of integers are expanded up to, as for `read`.
    quality : int, optional
        Quality of lossy formats, 1 to 100.
    progress : callable, optional
        ``progress(done, total)`` is called after each band. Each row counts twice: it is read for
        the smaller images of the bloom, and for the result.

    Returns
    -------
    tuple of str
        Notes about the files: parts and channels that were left out, NaN and infinity, a bloom that
        is zero everywhere, and what the target's format lost.

    Raises
    ------
    OSError
        A file cannot be read or written.
    ValueError
        A file is damaged or has another size than the image, an argument is out of range, or
        `renderer` is closed.
    TypeError
        `settings` is not a Settings.
    OutOfMemoryError
        The memory of host or device is too small.

    See Also
    --------
    read, write : Files as arrays.
    Renderer.apply : The same for an array.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = vkbloom.write(f"{folder}/in.exr", np.full((64, 48, 3), 2, np.float16))
    ...     with vkbloom.Renderer("software") as renderer:
    ...         notes = apply_file(path, f"{folder}/out.exr", renderer=renderer)
    ...     vkbloom.read(f"{folder}/out.exr").shape
    (64, 48, 3)
    """
    saved = Saved(output_colour, primaries, view)
    check_saved(saved)
    chosen = presets["bevy_natural"] if settings is None else check_settings(settings)
    reading = _Reading(
        os.fspath(source),
        is_blended=chosen.alpha != "keep",
        mask=None if mask is None else os.fspath(mask),
        emission=None if emission is None else os.fspath(emission),
        layer=layer,
        subimage=subimage,
        colour=input_colour,
        raw=raw,
        half=half,
        expand=expand,
    )
    work = _Work(reading, chosen, progress)
    if renderer is None:
        with Renderer() as own:
            work.write(own._core, Path(target), saved, quality, bits=bits)
    else:
        work.write(renderer._core, Path(target), saved, quality, bits=bits)
    return tuple(work.notes)


class _Work:
    """One file with its settings, the rows that are done, and the notes."""

    def __init__(
        self,
        reading: _Reading,
        settings: Settings,
        progress: Callable[[int, int], object] | None,
    ) -> None:
        self._reading = reading
        self._settings = settings
        self._progress = progress
        self._done = 0
        self._is_zero = False
        self.notes: dict[str, None] = {}

    def write(
        self,
        core: _core.Renderer,
        target: Path,
        saved: Saved,
        quality: int | None,
        *,
        bits: int | None,
    ) -> None:
        """Render the file and write the result."""
        facts = settings_facts(self._settings, self._reading.expand)
        height = self._reading.height
        with ExitStack() as stack:
            finals = self._finals(core, stack)
            write = stack.enter_context(
                written_rows(target, height, saved, facts, quality, bits=bits)
            )
            for final in finals:
                if not self._is_zero and self._reading.writes_straight(target):
                    hidden = no_bloom.hidden(final, self._settings)
                    self.notes.update(dict.fromkeys(filter(None, [hidden])))
                losses = write(self._reading.result(final, self._settings))
                self.notes.update(dict.fromkeys(losses))
                self._count(len(final))

    def _finals(self, core: _core.Renderer, stack: ExitStack) -> Iterator[NDArray[Any]]:
        """Return bands of `final`."""
        height = self._reading.height
        bands = stack.enter_context(closing(self._reading.bands(self.notes)))
        first = next(bands)
        taken = itertools.chain([first], bands)
        count = min(len(first.image), LONGEST_SIDE // 4)
        bloom = BloomByBands.of(core, self._settings, first, height, count)
        if bloom is None:
            return self._held_whole(core, taken)
        for count in bloom.reduce(taken):
            self._count(count)
        self._is_zero = bloom.is_without
        if bloom.is_without:
            self.notes[f"{self._reading.source}: {no_bloom.reason(self._settings)}"] = None
        return bloom.finals(stack.enter_context(closing(self._reading.bands())))

    def _held_whole(self, core: _core.Renderer, bands: Iterator[Band]) -> Iterator[NDArray[Any]]:
        """Yield bands of `final` of an image that is complete on the device."""
        first, height = next(bands), self._reading.height
        image = ImageByBands(core, first, height, self._settings)
        self._count(len(first.image))
        for band in bands:
            image.add(band)
            self._count(len(band.image))
        for top in range(0, height, len(first.image)):
            yield image.final(top, min(len(first.image), height - top))

    def _count(self, rows: int) -> None:
        self._done += rows
        if self._progress is not None:
            self._progress(self._done, 2 * self._reading.height)


class _Reading:
    """A picture with its mask and its emission, which can be read several times."""

    def __init__(
        self,
        source: str,
        *,
        is_blended: bool,
        mask: str | None,
        emission: str | None,
        layer: str | None,
        subimage: int | None,
        colour: Colour | None,
        raw: bool,
        half: bool | None,
        expand: float | None,
    ) -> None:
        self.source = source
        self._is_blended = is_blended
        self._mask, self._emission = mask, emission
        self._layer, self._subimage = layer, subimage
        self._colour, self._raw, self.expand = colour, raw, expand
        self._picture: Picture | None = None
        with opened_rows(source, subimage or 0, layer) as rows:
            self._size = rows.size
        if raw and rows.numbers != "uint8":
            raise ValueError(f"raw: {source} has {rows.numbers}, not 8-bit integers")
        if half is None:
            half = rows.numbers == "uint8" and rows.size[0] * rows.size[1] >= HALVED
        self._half = half and not raw

    @property
    def height(self) -> int:
        """Number of rows."""
        return self._size[1]

    def bands(self, told: dict[str, None] | None = None) -> Generator[Band]:
        """Yield bands from the top to the bottom; add notes to `told` at the end."""
        notes = [_Notes(file or "") for file in (self.source, self._emission, self._mask)]
        with ExitStack() as stack:
            rows = stack.enter_context(opened_rows(self.source, self._subimage or 0, self._layer))
            emission, mask = (
                None if file is None else stack.enter_context(opened_rows(file))
                for file in (self._emission, self._mask)
            )
            for name, other in (("emission", emission), ("mask", mask)):
                if other is not None and other.size != self._size:
                    raise ValueError(
                        f"{name}: shape {other.size[::-1]} is not the image's, {self._size[::-1]}"
                    )
            for stored in rows.bands():
                picture = self._decoded(stored, notes[0])
                if self._picture is None:
                    self._picture = replace(picture, pixels=picture.pixels[:1])
                    if len(stored.parts) > 1 and self._layer is None and self._subimage is None:
                        notes[0].add_text(
                            f"read the first of its {image_reading.listed_parts(stored)}; "
                            "subimage reads another"
                        )
                yield self._band(picture.pixels, emission, mask, notes)
        if told is not None:
            told.update(dict.fromkeys(text for one in notes for text in one.texts()))

    def _band(
        self, image: NDArray[Any], emission: Rows | None, mask: Rows | None, notes: list[_Notes]
    ) -> Band:
        """Return rows of the image with the next rows of emission and mask."""
        glow = values = None
        if emission is not None:
            picture = self._decoded(emission.take(len(image)), notes[1])
            glow = check_emission(alike(picture.pixels, image), image)
        if mask is not None:
            read = image_reading.decode_file(mask.take(len(image)), notes[2].file, "linear")
            notes[2].add(read)
            values = check_mask(grey_mask(read.pixels, notes[2].file), image.shape[:2])
        return Band(image, glow, values)

    def _decoded(self, stored: StoredImage, notes: _Notes) -> Picture:
        # Only the picture's own highlights are expanded, not those of an emission.
        expand = self.expand if notes.file == self.source else None
        picture = image_reading.decode_file(
            stored, notes.file, self._colour, raw=self._raw, expand=expand
        )
        notes.add(picture)
        if self._is_blended:
            picture = premultiplied(picture)
        elif notes.file == self.source:
            notes.add_light(picture)
        if self._half and picture.pixels.dtype == np.float32:
            picture = replace(picture, pixels=picture.pixels.astype(np.float16))
        return picture

    def writes_straight(self, target: Path) -> bool:
        """Return whether `target` has alpha, and colours that are not multiplied by it."""
        assert self._picture is not None
        is_associated = self._picture.stored.associated
        return image_writing.is_straight(target, is_associated=is_associated)

    def result(self, final: NDArray[Any], settings: Settings) -> Picture:
        """Return rows of `final` as a picture with the properties of the file."""
        assert self._picture is not None
        return finished(self._picture, final, settings)


class _Notes:
    """Notes about a picture, collected over all bands."""

    def __init__(self, file: str) -> None:
        self.file = file
        self._nan = self._infinite = 0
        self._hidden = self._visible = 0.0
        self._texts: dict[str, None] = {}

    def add(self, picture: Picture) -> None:
        self._nan += int(np.isnan(picture.values).sum())
        self._infinite += int(np.isinf(picture.values).sum())
        self._texts.update(dict.fromkeys(picture.notes))

    def add_light(self, picture: Picture) -> None:
        self._hidden += picture.hidden
        self._visible += picture.visible

    def add_text(self, text: str) -> None:
        self._texts[text] = None

    def texts(self) -> Iterator[str]:
        """Yield each note once, with the name of the file."""
        note = image_reading.non_finite_note(self._nan, self._infinite)
        if note is not None:
            yield f"{self.file} {note}"
        for text in (*self._texts, *hidden_notes(self._hidden, self._visible)):
            yield f"{self.file}: {text}"


def finished(picture: Picture, final: NDArray[Any], settings: Settings) -> Picture:
    """Return a picture with the pixels of `final`, and their alpha and encoding as in its file."""
    if settings.alpha != "keep" and has_straight(picture):
        final = divided(final)
    done = picture.encoding if settings.encoding == "none" else settings.encoding
    return replace(picture, pixels=final, encoding=done)
