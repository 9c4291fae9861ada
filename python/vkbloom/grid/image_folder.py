"""A grid as image files, one per framebuffer of each point."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.frames import Frames
from vkbloom.grid.identity import differences, identity
from vkbloom.grid.layout import Grid, Layout
from vkbloom.grid.memory import chunk_of
from vkbloom.grid.order import Block, Index, blocks, points
from vkbloom.grid.parts import WHOLE, Part
from vkbloom.grid.running import Writer
from vkbloom.grid.sources import ImageSource
from vkbloom.io import image_writing, safe_writing
from vkbloom.io.files import settings_facts
from vkbloom.io.images import Picture, SavedColour, check_name

__all__ = ["FileForm", "GridFiles"]

_INDEX: Final = "grid.json"


@dataclass(frozen=True)
class FileForm:
    """Encoding and number type of an image's `final` files, as in `vkbloom.io.images.Picture`.

    `expand`: What the image's highlights were expanded up to.
    """

    encoding: SavedColour | None
    numbers: str
    grey: bool
    expand: float | None = None


@dataclass(frozen=True)
class _FileWriter:
    """Writes the files of points; it can be sent to the process that renders them."""

    folder: Path
    suffix: str
    grid: Grid
    layout: Layout
    forms: tuple[FileForm, ...]

    def paths(self, index: Index) -> dict[str, Path]:
        """Return a point's files by framebuffer."""
        number = "_".join(
            f"{place:0{max(3, len(str(count - 1)))}}"
            for place, count in zip(index, self.grid.shape, strict=True)
        )
        names = list(self.layout.variables)
        return {
            name: self.folder / f"{'_'.join(filter(None, (number, name)))}{self.suffix}"
            for name in names
        }

    def write(self, block: Block, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write the files of a block's points, each atomically."""
        for index in points(block, self.layout.ranking):
            place = tuple(i - start for i, start in zip(index, block.start, strict=True))
            for name, path in self.paths(index).items():
                self._save(index, name, arrays[name][place], path)

    def _save(self, index: Index, name: str, array: NDArray[Any], path: Path) -> None:
        point = self.grid.point(index)
        if name == "final" and self.forms:
            form = self.forms[int(point.place)]
            encoded = point.settings.encoding
            picture = replace(
                Picture.of_values(array, form.numbers),
                encoding=form.encoding if encoded == "none" else encoded,
                grey=form.grey,
            )
            facts = settings_facts(point.settings, form.expand)
            image_writing.save(picture, path, None, facts)
            return
        info = {"adapter": self.layout.adapter, "driver": self.layout.driver}
        frames = Frames({name: array}, timings={}, settings=point.settings, info=info)
        # A framebuffer that the format cannot hold is written as an OpenEXR file.
        frames.save(path)

    def is_there(self, index: Index) -> bool:
        """Return whether all files of a point exist."""
        return all(
            path.exists() or path.with_suffix(".exr").exists()
            for path in self.paths(index).values()
        )

    def flush(self, written: Iterable[Block]) -> None:
        """Do nothing: each file is renamed to its final name when it is complete."""


class GridFiles:
    """A folder of image files, ``<index along each axis>_<framebuffer>``, with ``grid.json``.

    - `suffix`: Extension of the image files, such as ".png". A framebuffer that the format cannot
      hold without conversion is written as ``.exr``.
    - `grid`: A grid without reductions.
    - `forms`: How `final` is written, by image; empty: without conversion.
    """

    def __init__(
        self,
        folder: Path,
        suffix: str,
        grid: Grid,
        layout: Layout,
        forms: Sequence[FileForm] = (),
        *,
        part: Part = WHOLE,
    ) -> None:
        image_writing.check_writable(f"image{suffix}")
        check_name(folder)
        # The writer is sent with every task and does not need the pixels.
        light = replace(grid, source=ImageSource(()))
        self._files = _FileWriter(folder.absolute(), suffix, light, layout, tuple(forms))
        self._identity = {**identity(grid, layout, ()), "suffix": suffix}
        self._chunk = chunk_of(grid, layout, part[1])
        self._part = part
        self.done = np.zeros(grid.shape, np.bool_)

    @property
    def writer(self) -> Writer:
        """The writer of files, which can be sent to other processes."""
        return self._files

    def _blocks(self) -> Iterable[Block]:
        files = self._files
        return blocks(files.grid.shape, self._chunk, files.layout.ranking, self._part)

    @property
    def total(self) -> int:
        """Number of points of the part."""
        return sum(block.count for block in self._blocks())

    def missing(self) -> Iterable[Block]:
        """Return the blocks that are not done, in the order in which they are rendered."""
        return (block for block in self._blocks() if not self.done[block.slices].all())

    def mark(self, written: Iterable[Block]) -> None:
        """Mark points as done."""
        for block in written:
            self.done[block.slices] = True

    def finish(self) -> None:
        """Do nothing: each file is complete."""

    def prepare(self, *, resume: bool) -> None:
        """Create the folder, or examine an existing one."""
        files = self._files
        index = files.folder / _INDEX
        own = self._identity
        files.folder.mkdir(parents=True, exist_ok=True)
        if all(safe_writing.is_temporary(path) for path in files.folder.iterdir()):
            safe_writing.write_file(index, json.dumps(own, indent=1).encode())
            return
        try:
            stored = json.loads(index.read_text())
        except FileNotFoundError:
            raise ValueError(
                f"{files.folder}: the folder is not empty, and its content is not a grid of vkbloom"
            ) from None
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{index}: damaged, {error}") from error
        if not resume:
            raise FileExistsError(
                f"{files.folder}: the folder already has a grid; resume it, or name another folder"
            )
        found = differences(stored, own)
        if found:
            raise ValueError(f"{files.folder}: contains another grid; {'; '.join(found)}")
        for block in self._blocks():
            for place in points(block, files.layout.ranking):
                self.done[place] = files.is_there(place)
