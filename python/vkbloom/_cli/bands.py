"""Large images by bands of rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from vkbloom import _core

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vkbloom._settings.settings import Settings

__all__ = ["Band", "BloomByBands", "ImageByBands"]


@dataclass(frozen=True, eq=False)
class Band:
    """Rows of an image, of its emission and of its mask.

    - `image`: ndarray, shape (N, W, 3) or (N, W, 4); As for `vkbloom.Renderer.apply`.
    - `emission`: Of the image's shape and dtype.
    - `mask`: ndarray of float32, shape (N, W), optional.
    """

    image: NDArray[Any]
    emission: NDArray[Any] | None = None
    mask: NDArray[np.float32] | None = None

    def rows(self, first: int, end: int | None = None) -> Band:
        """Return rows `first` to `end` of it."""
        return Band(
            self.image[first:end],
            None if self.emission is None else self.emission[first:end],
            None if self.mask is None else self.mask[first:end],
        )

    def joined(self, other: Band) -> Band:
        """Return its rows, and after them those of another band."""
        return Band(
            np.concatenate([self.image, other.image]),
            None
            if self.emission is None or other.emission is None
            else np.concatenate([self.emission, other.emission]),
            None
            if self.mask is None or other.mask is None
            else np.concatenate([self.mask, other.mask]),
        )

    def source(self, levels: tuple[NDArray[Any], ...] = ()) -> _core.Source:
        """Return it as the core takes it, with smaller images."""
        return _core.image_source(self.image, self.emission, self.mask, levels)


class BloomByBands:
    """Bloom of an image that is processed band by band, with the same bits as in one call.

    Only smaller images of the bloom are complete in memory: the largest one, which is computed
    band by band, and those from which `final` is computed.

    - `sample`: Any rows of the image.
    - `height`: Height of the image in rows.
    """

    def __init__(
        self,
        core: _core.Renderer,
        settings: Settings,
        sample: Band,
        height: int,
        parts: _Parts,
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
        """Return an object for these settings; None if the bloom needs the complete image.

        Reasons: a bloom that reaches too far; dithering, which depends on the position; and heights
        without a small common divisor, for passes that need a row at the same position in all
        images (Godot's, and `Separable` with buffers of another size).
        """
        found = core.bands(sample.source(), settings, height)
        if found is None:
            return None
        head, head_height, levels, step, reach = found
        rows, halo = max(rows // step, 1) * step, -(-reach // step) * step
        parts = _Parts(head, head_height, levels, rows, halo)
        if 2 * (parts.rows + 2 * parts.halo) > height:
            return None
        return cls(core, settings, sample, height, parts)

    def reduce(self, bands: Iterable[Band]) -> Iterator[int]:
        """Read the image from top to bottom; yield each band's number of rows."""
        head, head_height, names, _, _ = self._parts
        if head is None:
            for band in bands:
                yield len(band.image)
            return
        reduced: list[NDArray[Any]] = []
        for window in self._windows(bands):
            (array,) = self._render(window.rows.source(), (head,), (self._height, (), window.top))
            # The first row that belongs to the window, and those of the window's own rows.
            top, first, end = (
                -(-place * head_height // self._height)
                for place in (window.top, window.top + window.first, window.top + window.end)
            )
            reduced.append(array[first - top : end - top])
            yield window.end - window.first
        smaller = np.concatenate(reduced)
        del reduced
        others = tuple(name for name in names if name != head)
        source = self._sample.source((smaller,))
        made = self._render(source, others, (self._height, (head,), -1)) if others else ()
        found = {**dict(zip(others, made, strict=True)), head: smaller}
        self._levels = tuple(found[name] for name in names)

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
            (final,) = self._render(
                window.rows.source(levels),
                ("final",),
                (self._height, self._parts.levels, first),
            )
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


class _Parts(NamedTuple):
    """How an image is divided: see graph/bands.h of the core.

    - `head`: The smaller image that is computed band by band.
    - `levels`: The smaller images from which `final` is computed.
    - `rows`: Rows of a band.
    - `halo`: Rows above and below a band that it depends on.
    """

    head: str | None
    head_height: int
    levels: tuple[str, ...]
    rows: int
    halo: int


class _Window(NamedTuple):
    """A band with the rows around it.

    - `top`: Position of the first row in the image.
    - `first`, `end`: The rows of the band itself.
    """

    rows: Band
    top: int
    first: int
    end: int


class ImageByBands:
    """An image of which the device has all rows, and the host only one band at a time.

    - `rows`: The first rows.
    - `height`: Height of the image in rows.
    """

    def __init__(self, core: _core.Renderer, rows: Band, height: int, settings: Settings) -> None:
        self._core = core
        self._source = core.upload(rows.source(), None, False, height)
        # Also refuses what does not fit the device, before more rows are read.
        self._plan = core.plan(self._source, settings, ("final",))
        self._filled = len(rows.image)

    def add(self, rows: Band) -> None:
        """Give it the next rows, of the same width, channels and dtype."""
        self._core.fill(self._source, rows.source(), self._filled)
        self._filled += len(rows.image)

    def final(self, first: int, count: int) -> NDArray[Any]:
        """Return rows of the framebuffer `final`; the first call renders it."""
        ((_, (_, *rest), dtype),) = self._plan.outputs
        array = np.empty((count, *rest), dtype)
        self._core.run(self._source, (self._plan,), ((array,),), False, first, count).wait()
        return array
