"""``vkbloom apply``: add bloom to an image file."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom
from vkbloom import no_bloom
from vkbloom.cli.device_options import device_options
from vkbloom.cli.fields import Command
from vkbloom.cli.glow_options import accompanying, glow_options, note_step, uploaded
from vkbloom.cli.image_files import (
    check_input_colour,
    expand_option,
    input_colour_option,
    layer_option,
    read_picture,
    silenced,
    subimage_option,
)
from vkbloom.cli.overlapped import read_ahead, rendered
from vkbloom.cli.program import as_wrong_use
from vkbloom.cli.program import given as was_given
from vkbloom.cli.sequences import PIPE, check_targets, pairs
from vkbloom.cli.settings_options import settings_options
from vkbloom.cli.terminal import detail, hides_progress, note, say, tell_device
from vkbloom.interruptible import opened_renderer
from vkbloom.io import image_writing
from vkbloom.io.array_files import premultiplied
from vkbloom.io.displayed import PRIMARIES, Saved, check_saved
from vkbloom.io.images import Colour, Picture, SavedColour
from vkbloom.large_files import finished, is_large
from vkbloom.written_behind import written_behind

CURVES = ("linear", "srgb", "gamma22", "pq", "hlg")


@click.command(cls=Command)
@click.argument("sources", metavar="IN... OUT", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o", "--out", metavar="OUT", type=click.Path(), help="The file to write, instead of OUT."
)
@click.option(
    "--quality",
    metavar="N",
    type=click.IntRange(1, 100),
    help="Quality of JPEG, WebP and JPEG XL [default 98 for JPEG]",
)
@click.option(
    "--pipe-format",
    metavar="EXTENSION",
    default="png",
    show_default=True,
    help="Format of standard output.",
)
@click.option(
    "--attachments",
    metavar="all|NAME,...",
    default="final",
    show_default=True,
    help="The framebuffers to write. final is written to OUT; each other framebuffer is written "
    "beside it, as OUT's name with _NAME appended, its values not converted. A framebuffer that "
    "OUT's format cannot hold is written as .exr.",
)
@input_colour_option
@click.option(
    "--output-colour",
    type=click.Choice(CURVES),
    help="Encoding of the colours in OUT [default linear for floats, srgb for integers]; pq and "
    "hlg have 16 bits where the format has them",
)
@click.option(
    "--primaries",
    type=click.Choice([*PRIMARIES]),
    default="rec709",
    show_default=True,
    help="Primaries of the colours in OUT, which PNG and OpenEXR can name.",
)
@click.option(
    "--view",
    metavar="VIEW",
    help="A view of OpenColorIO's built-in configuration, such as 'ACES 2.0 - SDR 100 nits "
    "(Rec.709)', or DISPLAY/VIEW. It has a tone curve, an encoding and primaries of its own. The "
    "error for an unknown one lists all.",
)
@click.option(
    "--raw",
    is_flag=True,
    help="Do not decode or encode colours: use the values of an 8-bit file unchanged, in 8-bit "
    "buffers.",
)
@click.option(
    "--half/--no-half",
    "half",
    default=None,
    help="Hold large pictures in half floats, which need half the memory [default for 8-bit files "
    "of at least 64 million pixels]",
)
@click.option("--overwrite", is_flag=True, help="OUT may be a file that is read as IN.")
@expand_option
@subimage_option
@layer_option
@glow_options
@device_options
@settings_options
def command(
    *, sources: tuple[str, ...], out: str | None, adapter: str, validation: bool, **given: Any
) -> None:
    """Add bloom to the image IN and write the result to OUT.

    The extension selects the format: OpenEXR, Radiance HDR, PNG, JPEG, TIFF and others. IN and OUT
    may be folders, patterns of numbers (f.%04d.exr, f.####.exr) or - for a pipe. IN may also be a
    glob, or several files.

    Without --preset and --method, files of integers (JPEG, PNG) start from the preset photo, and
    their highlights are expanded; files of floats start from bevy_natural. Further options change
    the settings.

    Bloom is computed in linear colours. Files of 8 or 16 bit integers are decoded to 32-bit floats
    with Rec. 709 colours. Files of floats are linear. OUT has the number type of IN, or the closest
    one of its format. Integers are encoded to sRGB and clipped to 0..1; colours above 1 keep their
    hue. Floats (as in OpenEXR and Radiance HDR) are written linear. Alpha does not change, unless
    --alpha is given. OUT is replaced when the new file is complete. See docs/command-line.md.
    """
    options = _Options(**given)
    inputs, target = _arguments(sources, out)
    work = _planned(options, inputs, target)
    with tempfile.TemporaryDirectory() as folder, silenced(), ExitStack() as stack:

        @functools.cache
        def renderer() -> vkbloom.Renderer:
            opened = stack.enter_context(opened_renderer(adapter, validation))
            # Standard output may have the picture.
            tell_device(opened, err=target == PIPE)
            return opened

        run = _Run(options, target, Path(folder), renderer, several=len(work) > 1)
        for is_alone, group in itertools.groupby(work, key=lambda pair: run.is_by_rows(pair[0])):
            if is_alone:
                for pair in group:
                    run.large_file(*pair)
            else:
                run.sequence([*group])
    note_step(options.settings, options.mask, options.emission)
    if len(work) > 1:
        say(f"wrote {len(work)} images, {work[0][1]} to {work[-1][1]}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Options:
    """The options of the command by their names."""

    quality: int | None
    pipe_format: str
    attachments: str
    input_colour: Colour | None
    output_colour: SavedColour | None
    primaries: str
    view: str | None
    raw: bool
    half: bool | None
    overwrite: bool
    expand: float | None
    subimage: int
    layer: str | None
    mask: str | None
    emission: str | None
    settings: vkbloom.Settings

    @property
    def names(self) -> str | list[str]:
        """The framebuffers to write."""
        return "all" if self.attachments == "all" else ["final", *self.attachments.split(",")]

    @property
    def saved(self) -> Saved:
        """What the colours of OUT are to be."""
        return Saved(self.output_colour, self.primaries, self.view)

    @property
    def is_blended(self) -> bool:
        """Whether colours are multiplied by alpha."""
        return self.settings.alpha != "keep"


def _planned(options: _Options, sources: list[str], out: str) -> list[tuple[str, str]]:
    """Check the options, and return the files to read, each with the file to write."""
    _check_colours(options.settings, options.input_colour, options.saved, raw=options.raw)
    check_input_colour(options.input_colour)
    if out == PIPE and options.attachments != "final":
        raise click.UsageError("standard output takes only final; leave out --attachments")
    work = pairs(sources, out)
    check_targets(work, out, overwrite=options.overwrite)
    with as_wrong_use():
        for target in {Path(target).suffix: target for _, target in work}.values():
            checked = f"image.{options.pipe_format}" if out == PIPE else target
            _check_writable(checked)
            image_writing.check_quality(checked, options.quality)
    return work


class _Run:
    """The files of one call."""

    def __init__(
        self,
        options: _Options,
        out: str,
        folder: Path,
        renderer: Callable[[], vkbloom.Renderer],
        *,
        several: bool,
    ) -> None:
        self._options = options
        self._out = out
        self._folder = folder
        self._renderer = renderer
        self._several = several
        self._hidden = hides_progress()

    def is_by_rows(self, name: str) -> bool:
        """Whether a file is read and written in bands of rows."""
        options = self._options
        is_piped = PIPE in (name, self._out)
        is_alone = options.attachments == "final" and not is_piped
        return is_alone and is_large(name, options.subimage, options.layer)

    def large_file(self, name: str, target: str) -> None:
        """Add bloom to one file in bands of rows."""
        options = self._options
        if target != self._out:
            Path(target).parent.mkdir(exist_ok=True)
        with tqdm(unit="row", leave=False, disable=self._hidden) as bar:

            def show(done: int, total: int) -> None:
                bar.total = total
                bar.update(done - bar.n)

            with _wrong_use_of("mask", "emission", "raw"):
                notes = vkbloom.apply_file(
                    name,
                    target,
                    options.settings,
                    renderer=self._renderer(),
                    mask=options.mask,
                    emission=options.emission,
                    layer=options.layer,
                    subimage=options.subimage if was_given("subimage") else None,
                    input_colour=options.input_colour,
                    output_colour=options.output_colour,
                    primaries=options.primaries,
                    view=options.view,
                    raw=options.raw,
                    half=options.half,
                    expand=options.expand,
                    quality=options.quality,
                    progress=show,
                )
        for text in notes:
            note(text)
        if not self._several:
            say(f"wrote {target}")

    def sequence(self, files: list[tuple[str, str]]) -> None:
        """Add bloom to files one after the other; read and write others meanwhile."""
        options, settings = self._options, self._options.settings
        # Read before the device is opened, so that a wrong file fails at once.
        first = self._read(files[0][0])
        prepared = functools.partial(_prepared, self._renderer(), self._glow_of)
        wanted = no_bloom.with_bloom(options.names, settings)
        with as_wrong_use():
            self._renderer().plan(prepared(first), settings, attachments=wanted)
        ahead = read_ahead(self._read, [name for name, _ in files[1:]])
        pictures = itertools.chain([first], ahead)
        results = rendered(self._renderer(), pictures, settings, wanted, prepared)
        del first
        hidden = self._hidden if self._several else True
        bar = tqdm(results, total=len(files), unit="image", leave=False, disable=hidden)
        with contextlib.closing(results):
            for _ in written_behind(self._made(zip(bar, files, strict=True))):
                pass

    def _made(self, results: Iterable[Any]) -> Iterator[tuple[str, Callable[[], object]]]:
        """Yield the name of each file, and the function that writes it."""
        for (picture, frames), (name, target) in results:
            for text in no_bloom.notes(frames, picture.pixels):
                note(f"{name}: {text}" if self._several else text)
            seconds = sum(frames.timings.values())
            detail(f"{name}: {1e3 * seconds:.2f} ms on the device")
            kept = no_bloom.only(frames, self._options.names)
            yield target, functools.partial(self._write, picture, kept, target)

    def _read(self, source: str) -> Picture:
        options = self._options
        file = _piped_in(self._folder) if source == PIPE else source
        try:
            picture = read_picture(
                file,
                options.subimage,
                options.input_colour,
                layer=options.layer,
                raw=options.raw,
                expand=options.expand,
            )
        except ValueError as error:
            # The user does not know the temporary folder of standard input.
            raise ValueError(str(error).replace(f"{self._folder}{os.sep}", "")) from error
        return premultiplied(picture) if options.is_blended else picture

    @functools.cached_property
    def _glow_of(self) -> Callable[[NDArray[Any]], Any]:
        """Mask and emission for an image. Their files are read once."""
        options = self._options
        return accompanying(
            options.mask,
            options.emission,
            options.input_colour,
            raw=options.raw,
            is_blended=options.is_blended,
        )

    def _write(self, picture: Picture, frames: vkbloom.Frames, target: str) -> None:
        if target != self._out:
            Path(target).parent.mkdir(exist_ok=True)
        is_piped = self._out == PIPE
        file = self._folder / f"output.{self._options.pipe_format}" if is_piped else Path(target)
        written = _written(picture, frames, file, self._options)
        if is_piped:
            sys.stdout.buffer.write(file.read_bytes())
        elif not self._several:
            for path in written:
                say(f"wrote {path}")


@contextlib.contextmanager
def _wrong_use_of(*names: str) -> Iterator[None]:
    """Convert a ValueError that names one of these arguments to click.UsageError."""
    try:
        yield
    except ValueError as error:
        if str(error).startswith(tuple(f"{name}:" for name in names)):
            raise click.UsageError(str(error)) from error
        raise


def _check_writable(target: str) -> None:
    """Raise ValueError that names the file if its extension is not that of a writable format."""
    try:
        image_writing.check_writable(target)
    except ValueError as error:
        reason = str(error).removeprefix("path: ")
        raise ValueError(f"{target}: {reason}, such as .png or .exr") from None


def _check_colours(
    settings: vkbloom.Settings,
    input_colour: Colour | None,
    saved: Saved,
    *,
    raw: bool,
) -> None:
    """Raise click.UsageError for options that do not go together."""
    options = {"--output-colour": saved.curve, "--view": saved.view}
    options["--primaries"] = None if saved.primaries == "rec709" else saved.primaries
    used = [name for name, value in options.items() if value is not None]
    if raw and (input_colour or used):
        left_out = " and ".join(["--input-colour", *(used or ["--output-colour"])])
        raise click.UsageError(f"--raw does not convert colours; leave out {left_out}")
    if settings.encoding != "none" and settings.alpha != "keep":
        raise click.UsageError(
            f"--alpha {settings.alpha} needs linear colours; leave out --encoding: OUT is encoded "
            "for its format"
        )
    if settings.encoding != "none" and used:
        raise click.UsageError(
            f"--encoding {settings.encoding} already encodes the output; leave out {used[0]}"
        )
    with as_wrong_use():
        check_saved(saved)


def _prepared(
    renderer: vkbloom.Renderer, given_with: Callable[[NDArray[Any]], Any], picture: Picture
) -> Any:
    """Return a picture's image with its mask and emission."""
    return uploaded(renderer, picture.pixels, given_with(picture.pixels))


def _arguments(sources: tuple[str, ...], out: str | None) -> tuple[list[str], str]:
    """Return the INs and OUT, which is the last argument or that of --out."""
    if out is not None:
        return [*sources], out
    if len(sources) < 2:
        raise click.UsageError("Missing argument 'OUT'.")
    return [*sources[:-1]], sources[-1]


def _piped_in(folder: Path) -> str:
    """Return a file with the content of standard input, which also tells its format."""
    path = folder / "standard input"
    path.write_bytes(sys.stdin.buffer.read())
    return str(path)


def _written(
    picture: Picture, frames: vkbloom.Frames, target: Path, options: _Options
) -> list[Path]:
    """Write `final` and the other framebuffers, and return the files."""
    written = _save_others(frames, target)
    notes = image_writing.save(
        finished(picture, frames["final"], frames.settings),
        target,
        options.saved,
        {
            "Software": f"vkbloom {vkbloom.__version__}",
            "vkbloom:settings": json.dumps(frames.settings.to_dict()),
        },
        options.quality,
    )
    for text in notes:
        note(text)
    return [target, *written]


def _save_others(frames: vkbloom.Frames, target: Path) -> list[Path]:
    """Write each framebuffer except `final` to its own file."""
    written: list[Path] = []
    for name, array in frames.items():
        if name != "final":
            alone = vkbloom.Frames(
                {name: array}, timings=frames.timings, settings=frames.settings, info=frames.info
            )
            written += alone.save(target.with_name(f"{target.stem}_{name}{target.suffix}"))
    return written
