"""Bloom of picture files by bands of rows: the files may be larger than the memory."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._checks import check_emission, check_mask
from vkbloom._cli import no_bloom
from vkbloom._cli.image_files import FileOptions, finished, part_notes
from vkbloom._io import image_reading, image_writing
from vkbloom._io.alpha import hidden_notes
from vkbloom._io.array_files import premultiplied
from vkbloom._io.glows import alike, grey_mask
from vkbloom._io.images import Picture, StoredImage
from vkbloom._io.rows import opened_rows, written_rows
from vkbloom._renderer.frame_files import settings_facts

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

__all__ = ["Band", "BloomByBands", "apply_file", "is_large"]

#: Pictures of this many pixels or more are processed in bands.
LARGE: Final = 1 << 24
#: Usual limit of an image's sides on devices. Longer pictures are processed in bands.
LONGEST_SIDE: Final = 1 << 14
#: 8-bit pictures of this many pixels or more become half floats, whose steps are finer.
HALVED: Final = 1 << 26


class Band(NamedTuple):
    """Rows of an image, and of its emission and its mask, as for `vkbloom.Renderer.apply`."""

    image: NDArray[Any]
    emission: NDArray[Any] | None = None
    mask: NDArray[np.float32] | None = None

    def rows(self, first: int, end: int | None = None) -> Band:
        """Return rows `first` to `end` of it."""
        return Band(*(None if one is None else one[first:end] for one in self))  # type: ignore[arg-type]

    def joined(self, other: Band) -> Band:
        """Return its rows, and after them those of another band."""
        pairs = zip(self, other, strict=True)
        return Band(*(None if one is None else np.concatenate([one, two]) for one, two in pairs))  # type: ignore[arg-type]

    def source(self, levels: tuple[NDArray[Any], ...] = ()) -> _core.Source:
        """Return it as the core takes it, with smaller images."""
        return _core.image_source(*self, levels)


class _Parts(NamedTuple):
    """How an image is divided: see graph/bands.h of the core.

    - `head`: The smaller image that is computed band by band; `levels`: those of `final`.
    - `rows`, `halo`: Rows of a band, and rows above and below it that it depends on.
    """

    head: str | None
    head_height: int
    levels: tuple[str, ...]
    rows: int
    halo: int


class _Window(NamedTuple):
    """A band with the rows around it, the first one's position, and the rows of the band itself."""

    rows: Band
    top: int
    first: int
    end: int


class BloomByBands:
    """Bloom of an image that is processed band by band, with the same bits as in one call.

    Only smaller images of the bloom are complete in memory: the largest one, which is computed
    band by band, and those from which `final` is computed.
    """

    def __init__(
        self, core: _core.Renderer, settings: Settings, sample: Band, height: int, parts: _Parts
    ) -> None:
        self._core = core
        self._settings = settings
        self._sample = sample.rows(0, 1)
        self._height = height
        self._parts = parts
        self._levels: tuple[NDArray[Any], ...] = ()

    @classmethod
    def of(
        cls, core: _core.Renderer, settings: Settings, sample: Band, height: int, rows: int
    ) -> Self | None:
        """Return an object for settings and any rows of an image; None: it is needed complete.

        Reasons: a bloom that reaches too far; dithering, which depends on the position; and heights
        without a small common divisor, for passes that need a row at the same position in all
        images (Godot's, and `Separable` with buffers of another size).
        """
        found = core.bands(sample.source(), settings, height)
        if found is None:
            return None
        head, head_height, levels, step, reach = found
        rows, halo = max(rows // step, 1) * step, -(-reach // step) * step
        if 2 * (rows + 2 * halo) > height:
            return None
        return cls(core, settings, sample, height, _Parts(head, head_height, levels, rows, halo))

    def reduce(self, bands: Iterable[Band]) -> Iterator[int]:
        """Read the image from top to bottom; yield each band's number of rows."""
        head, head_height, names, _, _ = self._parts
        if head is None:
            yield from (len(band.image) for band in bands)
            return
        reduced: list[NDArray[Any]] = []
        for window in self._windows(bands):
            (array,) = self._render(window.rows.source(), (head,), (self._height, (), window.top))
            # The first row that belongs to the window, and those of the window's own rows.
            top, first, end = (
                -(-row * head_height // self._height)
                for row in (window.top, window.top + window.first, window.top + window.end)
            )
            reduced.append(array[first - top : end - top])
            yield window.end - window.first
        smaller = np.concatenate(reduced)
        del reduced
        others = tuple(name for name in names if name != head)
        source = self._sample.source((smaller,))
        made = self._render(source, others, (self._height, (head,), -1)) if others else ()
        levels = {**dict(zip(others, made, strict=True)), head: smaller}
        self._levels = tuple(levels[name] for name in names)

    @property
    def is_without(self) -> bool:
        """Whether there is a bloom, and it is known to be zero everywhere; after `reduce`."""
        return bool(self._levels) and not any(level[:, :, :3].any() for level in self._levels)

    def finals(self, bands: Iterable[Band]) -> Iterator[NDArray[Any]]:
        """Read the image again and yield the rows of `final`; after `reduce`."""
        for window in self._windows(bands):
            first, end = window.top, window.top + len(window.rows.image)
            levels = tuple(
                level[first * len(level) // self._height : -(-end * len(level) // self._height)]
                for level in self._levels
            )
            part = (self._height, self._parts.levels, first)
            (final,) = self._render(window.rows.source(levels), ("final",), part)
            yield final[window.first : window.end]

    def _render(
        self, source: _core.Source, names: tuple[str, ...], part: tuple[int, tuple[str, ...], int]
    ) -> tuple[NDArray[Any], ...]:
        plan = self._core.plan(source, self._settings, names, part)
        arrays = {name: np.empty(shape, dtype) for name, shape, dtype in plan.outputs}
        self._core.run(source, (plan,), (tuple(arrays.values()),)).wait()
        return tuple(arrays[name] for name in names)

    def _windows(self, bands: Iterable[Band]) -> Iterator[_Window]:
        """Yield the bands of the image, each with the rows around it that it depends on."""
        held: Band | None = None
        top = first = 0  # the first row that is held, and that of the next band
        for band in bands:
            held = band if held is None else held.joined(band)
            end = top + len(held.image)
            while first < self._height:
                last = min(first + self._parts.rows, self._height)
                beyond = min(last + self._parts.halo, self._height)
                if beyond > end:
                    break
                yield _Window(held.rows(0, beyond - top), top, first - top, last - top)
                first = last
                kept = max(first - self._parts.halo, 0)
                held = held.rows(kept - top)
                top = kept


def is_large(path: str, subimage: int = 0, layer: str | None = None) -> bool:
    """Whether a file is processed in bands. False for a file that cannot be opened."""
    try:
        with opened_rows(path, subimage, layer) as rows:
            return rows.size[0] * rows.size[1] >= LARGE or max(rows.size) > LONGEST_SIDE
    except (OSError, ValueError):
        return False


def apply_file(
    core: _core.Renderer,
    source: str,
    target: Path,
    settings: Settings,
    options: FileOptions,
    *,
    expand: float | None = None,
    progress: Callable[[int, int], object] = lambda done, total: None,
) -> tuple[str, ...]:
    """Add bloom to an image file by bands of rows, write another file, and return notes.

    The result is that of `Renderer.apply` for the complete image, bit by bit on a CPU. Where the
    bloom reaches too far for bands, the device holds the complete image. `progress` gets the rows
    that are done, and their number: each counts twice.
    """
    work = _Work(core, source, settings, options, expand)
    with ExitStack() as stack:
        finals = work.finals(stack, progress)
        write = stack.enter_context(
            written_rows(
                target,
                work.size[1],
                options.saved,
                settings_facts(settings, expand),
                options.quality,
                bits=options.bits,
            )
        )
        for final in finals:
            picture = work.picture
            assert picture is not None
            if not work.is_zero and image_writing.is_straight(
                target, is_associated=picture.stored.associated
            ):
                work.notes[no_bloom.hidden(final, settings)] = None
            losses = write(finished(picture, final, settings))
            work.notes.update(dict.fromkeys(losses))
            work.count(len(final))
    return tuple(filter(None, work.notes))


class _Work:
    """A file with its mask and its emission, which are read twice, the rows done, and the notes."""

    def __init__(
        self,
        core: _core.Renderer,
        source: str,
        settings: Settings,
        options: FileOptions,
        expand: float | None,
    ) -> None:
        self._core, self._source, self._settings = core, source, settings
        self._options, self._expand = options, expand
        self._is_blended = settings.alpha != "keep"
        self._done = 0
        self._progress: Callable[[int, int], object] = lambda done, total: None
        self.is_zero = False
        self.picture: Picture | None = None
        self.notes: dict[str, None] = {}
        with opened_rows(source, options.subimage, options.layer) as rows:
            self.size = rows.size
        if options.raw and rows.numbers != "uint8":
            raise ValueError(f"raw: {source} has {rows.numbers}, not 8-bit integers")
        is_halved = rows.numbers == "uint8" and rows.size[0] * rows.size[1] >= HALVED
        self._half = (is_halved if options.half is None else options.half) and not options.raw

    def count(self, rows: int) -> None:
        """Count rows that are done."""
        self._done += rows
        self._progress(self._done, 2 * self.size[1])

    def finals(
        self, stack: ExitStack, progress: Callable[[int, int], object]
    ) -> Iterator[NDArray[Any]]:
        """Return bands of `final`."""
        self._progress, height = progress, self.size[1]
        bands = stack.enter_context(closing(self._bands(self.notes)))
        first = next(bands)
        taken = itertools.chain([first], bands)
        count = min(len(first.image), LONGEST_SIDE // 4)
        bloom = BloomByBands.of(self._core, self._settings, first, height, count)
        if bloom is None:
            return self._held_whole(taken)
        for count in bloom.reduce(taken):
            self.count(count)
        self.is_zero = bloom.is_without
        if bloom.is_without:
            self.notes[f"{self._source}: {no_bloom.reason(self._settings)}"] = None
        return bloom.finals(stack.enter_context(closing(self._bands())))

    def _held_whole(self, bands: Iterator[Band]) -> Iterator[NDArray[Any]]:
        """Yield bands of `final` of an image that is complete on the device, not on the host."""
        core, height, filled = self._core, self.size[1], 0
        for band in bands:
            if not filled:
                step = len(band.image)
                source = core.upload(band.source(), None, False, height)
                # Also refuses what does not fit the device, before more rows are read.
                plan = core.plan(source, self._settings, ("final",))
            else:
                core.fill(source, band.source(), filled)
            filled += len(band.image)
            self.count(len(band.image))
        ((_, (_, *rest), dtype),) = plan.outputs
        for top in range(0, height, step):
            array = np.empty((min(step, height - top), *rest), dtype)
            # The first call renders it.
            core.run(source, (plan,), ((array,),), False, top, len(array)).wait()
            yield array

    def _bands(self, collected: dict[str, None] | None = None) -> Generator[Band]:
        """Yield bands from the top to the bottom; add notes to `collected` at the end."""
        options = self._options
        files = (self._source, options.emission, options.mask)
        notes = [_Notes(file or "") for file in files]
        with ExitStack() as stack:
            rows = stack.enter_context(opened_rows(self._source, options.subimage, options.layer))
            emission, mask = (
                None if file is None else stack.enter_context(opened_rows(file))
                for file in files[1:]
            )
            for name, other in (("emission", emission), ("mask", mask)):
                if other and other.size != self.size:
                    raise ValueError(
                        f"{name}: shape {other.size[::-1]} is not the image's, {self.size[::-1]}"
                    )
            for stored in rows.bands():
                picture = self._decoded(stored, notes[0])
                image, glow, values = picture.pixels, None, None
                if self.picture is None:
                    self.picture = replace(picture, pixels=image[:1])
                    notes[0].texts.update(dict.fromkeys(part_notes(stored, options.layer)))
                if emission:
                    glow = self._decoded(emission.take(len(image)), notes[1]).pixels
                    glow = check_emission(alike(glow, image), image)
                if mask:
                    read = image_reading.decode_file(mask.take(len(image)), notes[2].file, "linear")
                    notes[2].add(read)
                    values = check_mask(grey_mask(read.pixels, notes[2].file), image.shape[:2])
                yield Band(image, glow, values)
        if collected is not None:
            collected.update(dict.fromkeys(text for one in notes for text in one.lines()))

    def _decoded(self, stored: StoredImage, notes: _Notes) -> Picture:
        is_picture = notes.file == self._source
        # Only the picture's own highlights are expanded, not those of an emission.
        picture = image_reading.decode_file(
            stored,
            notes.file,
            self._options.input_colour,
            raw=self._options.raw,
            expand=self._expand if is_picture else None,
        )
        notes.add(picture, with_light=is_picture and not self._is_blended)
        if self._is_blended:
            picture = premultiplied(picture)
        if self._half and picture.pixels.dtype == np.float32:
            picture = replace(picture, pixels=picture.pixels.astype(np.float16))
        return picture


@dataclass
class _Notes:
    """Notes about a file, collected over all bands."""

    file: str
    nan: int = 0
    infinite: int = 0
    hidden: float = 0.0
    visible: float = 0.0
    texts: dict[str, None] = field(default_factory=dict)

    def add(self, picture: Picture, *, with_light: bool = False) -> None:
        self.nan += int(np.isnan(picture.values).sum())
        self.infinite += int(np.isinf(picture.values).sum())
        self.texts.update(dict.fromkeys(picture.notes))
        if with_light:
            self.hidden += picture.hidden
            self.visible += picture.visible

    def lines(self) -> Iterator[str]:
        """Yield each note once, with the name of the file."""
        if (text := image_reading.non_finite_note(self.nan, self.infinite)) is not None:
            yield f"{self.file} {text}"
        for text in (*self.texts, *hidden_notes(self.hidden, self.visible)):
            yield f"{self.file}: {text}"
