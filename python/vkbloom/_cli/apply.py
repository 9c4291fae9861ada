"""``vkbloom apply``: add bloom to an image file."""

from __future__ import annotations

import functools
import itertools
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

import vkbloom
from vkbloom._cli.applied import Options, Pair, Run, of_format
from vkbloom._cli.fields import Command
from vkbloom._cli.image_files import (
    check_input_colour,
    expand_option,
    input_colour_option,
    layer_option,
    subimage_option,
)
from vkbloom._cli.program import adapter_option, as_wrong_use, described
from vkbloom._cli.sequences import check_targets, pairs
from vkbloom._cli.settings_options import start_options
from vkbloom._cli.streams import is_stream
from vkbloom._cli.terminal import complain, say, tell_device
from vkbloom._io import image_writing
from vkbloom._io.displayed import PRIMARIES, Saved, check_saved
from vkbloom._renderer.interruptible import opened_renderer

CURVES = ("linear", "srgb", "gamma22", "pq", "hlg")


@click.command(cls=Command)
@click.argument("sources", metavar="IN... OUT", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o", "--out", metavar="OUT", type=click.Path(), help="The file to write, instead of OUT."
)
@click.option(
    "--quality", metavar="N", type=click.IntRange(1, 100), help="Of JPEG, WebP and JPEG XL."
)
@click.option(
    "--pipe-format", metavar="EXTENSION", default="png", help="Format of standard output."
)
@input_colour_option
@click.option("--output-colour", type=click.Choice(CURVES), help="Encoding of the colours in OUT.")
@click.option(
    "--primaries", type=click.Choice([*PRIMARIES]), default="rec709", help="Of the colours in OUT."
)
@click.option(
    "--view", metavar="VIEW", help="A display's view of OpenColorIO's built-in configuration."
)
@click.option("--half", is_flag=True, help="Hold pictures in half floats, in half the memory.")
@click.option(
    "--bits",
    type=click.Choice(["8", "16", "32"]),
    callback=lambda _, __, value: value and int(value),
    help="Size of a number in OUT [default that of IN]",
)
@click.option("--overwrite", is_flag=True, help="OUT may be a file that is read as IN.")
@expand_option
@subimage_option
@layer_option
@click.option(
    "--mask", metavar="FILE", type=click.Path(), help="A grey image: white glows, black does not."
)
@click.option(
    "--emission", metavar="FILE", type=click.Path(), help="An image that glows instead of IN."
)
@adapter_option
@start_options
def command(*, sources: tuple[str, ...], out: str | None, adapter: str, **given: Any) -> int:
    """Add bloom to the image IN and write the result to OUT.

    The extension selects the format: OpenEXR, Radiance HDR, PNG, JPEG, TIFF and others. IN and OUT
    may be folders, patterns of numbers (f.%04d.exr) or - for a pipe. IN may also be a
    glob, or several files.

    Without --preset, --method and --settings, each file of integers (JPEG, PNG) starts from the
    preset photo, and its highlights are expanded; each file of floats starts from bevy_natural.
    Further options change the settings.

    Bloom is computed in linear colours. Files of 8 or 16 bit integers are decoded to 32-bit floats
    with Rec. 709 colours. Files of floats are linear. OUT has the number type of IN, or the closest
    one of its format. Integers are encoded to sRGB and clipped to 0..1; colours above 1 keep their
    hue. Floats (as in OpenEXR and Radiance HDR) are written linear. Alpha does not change, unless
    --alpha is given. OUT is replaced when the new file is complete. Of several images, those that
    fail are listed at the end, and the exit status is 1. See docs/command-line.md.
    """
    options = Options(**given)
    inputs, target = _arguments(sources, out)
    work = _planned(options, inputs, target)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:

        @functools.cache
        def renderer() -> vkbloom.Renderer:
            opened = stack.enter_context(opened_renderer(adapter))
            # Standard output may have the picture.
            tell_device(opened, err=is_stream(target))
            return opened

        several = len(work) > 1
        run = Run(
            options=options, out=target, folder=Path(folder), renderer=renderer, several=several
        )
        for begun, group in itertools.groupby(work, key=lambda pair: options.start.of(pair[0])):
            run.sequence([*group], *begun)
    written = [target for name, target in work if name not in run.failures]
    if len(work) > 1 and written:
        say(f"wrote {len(written)} images, {written[0]} to {written[-1]}")
    return _tell_failures(run.failures, work)


def _tell_failures(failures: Mapping[str, Exception], work: Sequence[Pair]) -> int:
    """Print the images that failed, in their order, and return the exit status."""
    if not failures:
        return 0
    for name, _ in work:
        if name in failures:
            text = described(failures[name])
            complain(text if name in text else f"{name}: {text}")
    complain(f"{len(failures)} of {len(work)} images failed")
    return 1


def _planned(options: Options, sources: list[str], out: str) -> list[Pair]:
    """Check the options, and return the files to read, each with the file to write."""
    check_input_colour(options.input_colour)
    work = pairs(sources, out)
    settings, _ = options.start.of(work[0][0])
    _check_colours(settings, options.saved)
    check_targets(work, out, overwrite=options.overwrite)
    with as_wrong_use():
        for target in {Path(target).suffix: target for _, target in work}.values():
            checked = of_format(target, options.pipe_format)
            _check_writable(checked)
            image_writing.check_quality(checked, options.quality)
            image_writing.check_bits(checked, options.bits)
    return work


def _check_writable(target: str) -> None:
    """Raise ValueError that names the file if its extension is not that of a writable format."""
    try:
        image_writing.check_writable(target)
    except ValueError as error:
        reason = str(error).removeprefix("path: ")
        raise ValueError(f"{target}: {reason}, such as .png or .exr") from None


def _check_colours(settings: vkbloom.Settings, saved: Saved) -> None:
    """Raise click.UsageError for options that do not go together."""
    options = {"--output-colour": saved.curve, "--view": saved.view}
    options["--primaries"] = None if saved.primaries == "rec709" else saved.primaries
    used = [name for name, value in options.items() if value is not None]
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


def _arguments(sources: tuple[str, ...], out: str | None) -> tuple[list[str], str]:
    """Return the INs and OUT, which is the last argument or that of --out."""
    if out is not None:
        return [*sources], out
    if len(sources) < 2:
        raise click.UsageError("Missing argument 'OUT'.")
    return [*sources[:-1]], sources[-1]
