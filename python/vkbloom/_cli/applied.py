"""What ``vkbloom apply`` does with its files, one after the other."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Final, TypeAlias

import click
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom
from vkbloom._background_writer import written_in_background
from vkbloom._cli import no_bloom
from vkbloom._cli.image_files import finished, read_picture
from vkbloom._cli.program import as_wrong_use
from vkbloom._cli.settings_options import Start
from vkbloom._cli.streams import PIPE, is_stream
from vkbloom._cli.terminal import hides_progress, note, say
from vkbloom._io import image_writing
from vkbloom._io.array_files import premultiplied
from vkbloom._io.displayed import Saved
from vkbloom._io.glows import alike, grey_mask
from vkbloom._io.images import Colour, Picture, SavedColour
from vkbloom._renderer.frame_files import settings_facts

#: A file to read, and the file to write.
Pair: TypeAlias = tuple[str, str]
#: From an image to its mask and emission.
Glow: TypeAlias = Callable[[NDArray[Any]], dict[str, Any]]

# Errors of one file, after which a batch goes on. A lost device fails for all of them.
_FAILURES: Final = (OSError, ValueError, MemoryError, click.ClickException)
# 8-bit pictures of this many pixels or more become half floats, whose steps are finer.
_HALVED: Final = 1 << 26


@dataclasses.dataclass(frozen=True, kw_only=True)
class Options:
    """The options of the command by their names."""

    subimage: int
    layer: str | None
    input_colour: Colour | None
    half: bool
    mask: str | None
    emission: str | None
    output_colour: SavedColour | None
    primaries: str
    view: str | None
    bits: int | None
    quality: int | None
    pipe_format: str
    overwrite: bool
    expand: float | None
    start: Start

    @property
    def saved(self) -> Saved:
        """What the colours of a written file are to be."""
        return Saved(self.output_colour, self.primaries, self.view)


def of_format(target: str, pipe_format: str) -> str:
    """Return a file name with the extension of the format of OUT, which may be a stream."""
    is_nameless = target == PIPE or (is_stream(target) and not Path(target).suffix)
    return f"image.{pipe_format}" if is_nameless else target


@dataclasses.dataclass(kw_only=True, eq=False)
class Run:
    """The files of one call; `failures` has the errors of a batch by the file that was read."""

    options: Options
    out: str
    folder: Path
    renderer: Callable[[], vkbloom.Renderer]
    several: bool
    failures: dict[str, Exception] = dataclasses.field(default_factory=dict)

    @contextlib.contextmanager
    def _of_file(self, pair: Pair) -> Iterator[None]:
        """Keep an error of one of several files, so that the others are done."""
        try:
            yield
        except _FAILURES as error:
            if not self.several:
                raise
            self.failures[pair[0]] = error

    def sequence(self, files: list[Pair], settings: vkbloom.Settings, expand: float | None) -> None:
        """Add bloom to files one after the other; each is written while the next one is made."""
        hidden = hides_progress() if self.several else True
        bar = tqdm(files, unit="image", leave=False, disable=hidden)
        for texts in written_in_background(self._made(bar, settings, expand)):
            for text in texts:
                note(text)

    def _made(
        self, files: Iterable[Pair], settings: vkbloom.Settings, expand: float | None
    ) -> Iterator[tuple[list[str], Callable[[], object]]]:
        """Yield of each file a list for notes, and the function that writes it and fills the list.

        Notes are printed by the thread that reads files, because it silences standard error.
        """
        is_blended = settings.alpha != "keep"
        wanted = no_bloom.with_bloom(["final"], settings)
        glow_of = self._glow_of(is_blended)
        for pair in files:
            picture = None
            with self._of_file(pair):
                picture = self._read(pair[0], expand, is_blended=is_blended)
            if picture is None:
                continue
            # Opened after the first file is read, so that a wrong file fails at once.
            renderer = self.renderer()
            with self._of_file(pair):
                with as_wrong_use():
                    image, glow = picture.pixels, glow_of(picture.pixels)
                    frames = renderer.apply(image, settings, **glow, framebuffers=wanted)
                self._tell(pair, picture, frames)
                texts: list[str] = []
                yield texts, functools.partial(self._write, pair, picture, frames, expand, texts)

    def _tell(self, pair: Pair, picture: Picture, frames: vkbloom.Frames) -> None:
        """Print a note about the bloom of a file."""
        name, target = pair
        text = ""
        if no_bloom.is_without(frames):
            brightest = no_bloom.brightest_of(picture.pixels)
            text = no_bloom.reason(frames.settings, brightest)
        elif self._is_straight(picture, target):
            text = no_bloom.hidden(frames["final"], frames.settings)
        if text:
            note(f"{name}: {text}" if self.several else text)

    def _is_straight(self, picture: Picture, target: str) -> bool:
        file = of_format(target, self.options.pipe_format)
        return image_writing.is_straight(file, is_associated=picture.stored.associated)

    def _read(self, source: str, expand: float | None, *, is_blended: bool) -> Picture:
        options = self.options
        picture = read_picture(
            source,
            options.subimage,
            options.input_colour,
            layer=options.layer,
            expand=expand,
            is_blended=is_blended,
        )
        picture = premultiplied(picture) if is_blended else picture
        pixels = picture.pixels
        is_large = picture.numbers == "uint8" and pixels[..., 0].size >= _HALVED
        if (options.half or is_large) and pixels.dtype == np.float32:
            picture = dataclasses.replace(picture, pixels=pixels.astype(np.float16))
        return picture

    @functools.cached_property
    def _glow_of(self) -> Callable[[bool], Glow]:
        # The files are read once.
        return functools.cache(self._read_glow)

    def _read_glow(self, is_blended: bool) -> Glow:
        """Return a function that gives mask and emission for an image."""
        options = self.options
        given: dict[str, NDArray[Any]] = {}
        if options.mask is not None:
            mask = read_picture(options.mask, 0, "linear").pixels
            given["mask"] = grey_mask(mask, options.mask)
        if options.emission is None:
            return lambda image: given
        emission = read_picture(options.emission, 0, options.input_colour)
        glow = (premultiplied(emission) if is_blended else emission).pixels
        return lambda image: {**given, "emission": alike(glow, image)}

    def _write(
        self,
        pair: Pair,
        picture: Picture,
        frames: vkbloom.Frames,
        expand: float | None,
        notes: list[str],
    ) -> None:
        target = pair[1]
        with self._of_file(pair):
            file = Path(target)
            if target != self.out:
                file.parent.mkdir(exist_ok=True)
            if is_stream(target):
                suffix = Path(of_format(target, self.options.pipe_format)).suffix
                file = self.folder / f"output{suffix}"
            notes += image_writing.save(
                finished(picture, frames["final"], frames.settings),
                file,
                self.options.saved,
                settings_facts(frames.settings, expand),
                self.options.quality,
                bits=self.options.bits,
            )
            if is_stream(target):
                _send(file, target)
            elif not self.several:
                say(f"wrote {file}")


def _send(file: Path, target: str) -> None:
    """Write a file's content to a stream."""
    with contextlib.ExitStack() as stack:
        content = stack.enter_context(file.open("rb"))
        if target == PIPE:
            shutil.copyfileobj(content, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        else:
            shutil.copyfileobj(content, stack.enter_context(open(target, "wb")))
