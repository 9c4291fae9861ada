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
from collections.abc import Callable
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
from vkbloom.cli.glow_options import (
    accompanying,
    glow_options,
    has_straight,
    premultiplied,
    uploaded,
)
from vkbloom.cli.image_files import (
    COLOURS,
    check_input_colour,
    input_colour_option,
    layer_option,
    note,
    read_picture,
    silenced,
    subimage_option,
)
from vkbloom.cli.in_a_row import read_ahead, rendered, written_behind
from vkbloom.cli.large import Large, apply_by_rows, is_large
from vkbloom.cli.program import as_wrong_use
from vkbloom.cli.sequences import PIPE, pairs
from vkbloom.cli.settings_options import settings_options
from vkbloom.interruptible import opened_renderer
from vkbloom.io import image_writing
from vkbloom.io.array_files import divided
from vkbloom.io.images import Colour, Picture, SavedColour
from vkbloom.settings import Encoding


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
    type=click.Choice(COLOURS),
    help="Encoding of the colours in OUT [default linear for floats, srgb for integers]",
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
@subimage_option
@layer_option
@glow_options
@device_options
@settings_options
def command(  # noqa: PLR0915  one step after the other
    *,
    sources: tuple[str, ...],
    out: str | None,
    quality: int | None,
    pipe_format: str,
    attachments: str,
    input_colour: Colour | None,
    output_colour: SavedColour | None,
    raw: bool,
    half: bool | None,
    subimage: int,
    layer: str | None,
    mask: str | None,
    emission: str | None,
    adapter: str,
    validation: bool,
    settings: vkbloom.Settings,
) -> None:
    """Add bloom to the image IN and write the result to OUT.

    OpenImageIO reads and writes the files; the extension selects the format: OpenEXR, Radiance
    HDR, PNG, JPEG, TIFF and others. IN and OUT may be folders; the names of the files are kept.
    They may be printf patterns (f.%04d.exr) or - for a pipe. IN may also be a glob, or several
    files.

    The settings are those of the preset bevy_natural, unless --preset or --method selects others.
    Further options change them.

    Bloom is computed in linear colours. Files of 8 or 16 bit integers are decoded to 32-bit floats
    with Rec. 709 colours. The decoding uses the ICC profile, the cICP chunk or the gamma of the
    file, or sRGB if it has none. Files of floats are linear; half stays half, and float stays
    float. --input-colour overrides this.

    OUT has the number type of IN, or the closest one that its format supports: a PNG of a float
    image has 8 bits. Integers are encoded to sRGB and clipped to 0..1. Floats (as in OpenEXR and
    Radiance HDR) are written linear. --output-colour overrides this. With --encoding, the values
    are already encoded and not converted again. EXIF, resolution and a JPEG's chroma subsampling
    are kept.

    --mask limits what glows. --emission glows instead of the image. Both apply to each IN.

    Alpha does not change, unless --alpha is given. With --alpha max or blur, straight colours are
    multiplied by alpha before, and divided by it afterwards. Grey images become RGB and grey again.
    If the data window of an OpenEXR file is smaller than its display window, the rest is black. A
    larger data window is used completely, and is kept if the format of OUT supports it. Images are
    rotated according to the orientation in the file. The first part of a file with several parts is
    read, or the part of --subimage. --layer selects one of several layers. Channels other than R,
    G, B and A are ignored.

    Pictures of at least 16 million pixels are read and written in bands of rows, except from a
    pipe. --half holds them in half floats.

    OUT is replaced when the new file is complete. A call that fails leaves no partial file.
    """
    _check_colours(settings, input_colour, output_colour, raw=raw)
    check_input_colour(input_colour)
    given, out = _arguments(sources, out)
    if out == PIPE and attachments != "final":
        raise click.UsageError("standard output takes only final; leave out --attachments")
    work = pairs(given, out)
    with as_wrong_use():
        for target in {Path(target).suffix: target for _, target in work}.values():
            checked = f"image.{pipe_format}" if out == PIPE else target
            _check_writable(checked)
            image_writing.check_quality(checked, quality)
    names = attachments if attachments == "all" else ["final", *attachments.split(",")]
    wanted = no_bloom.with_bloom(names, settings)
    several = len(work) > 1
    is_blended = settings.alpha != "keep"
    with tempfile.TemporaryDirectory() as folder, silenced():

        def taken(source: str) -> Picture:
            file = _piped_in(folder) if source == PIPE else source
            try:
                picture = read_picture(file, subimage, input_colour, layer=layer, raw=raw)
            except ValueError as error:
                # The user does not know the temporary folder of standard input.
                raise ValueError(str(error).replace(f"{folder}{os.sep}", "")) from error
            return premultiplied(picture) if is_blended else picture

        def write(picture: Picture, frames: vkbloom.Frames, target: str) -> None:
            if several:
                Path(target).parent.mkdir(exist_ok=True)
            file = Path(folder, f"output.{pipe_format}") if out == PIPE else Path(target)
            written = _written(picture, frames, file, output_colour, quality)
            if out == PIPE:
                sys.stdout.buffer.write(file.read_bytes())
            elif not several:
                for path in written:
                    click.echo(f"wrote {path}")

        how = Large(mask, emission, layer, subimage, input_colour, raw, half)

        def by_rows(name: str) -> bool:
            is_piped = PIPE in (name, out)
            return attachments == "final" and not is_piped and is_large(name, subimage, layer)

        def write_large(renderer: vkbloom.Renderer, name: str, target: str) -> None:
            if several:
                Path(target).parent.mkdir(exist_ok=True)
            apply_by_rows(
                renderer,
                name,
                Path(target),
                settings,
                how,
                colour=output_colour,
                quality=quality,
                disable=disable,
            )
            if not several:
                click.echo(f"wrote {target}")

        # Read once, before the first picture that is not read in bands.
        given_with = functools.cache(
            functools.partial(
                accompanying, mask, emission, input_colour, raw=raw, is_blended=is_blended
            )
        )
        # None: shown where standard error is a terminal.
        disable = None if sys.stderr is not None else True
        with ExitStack() as stack:
            renderer: vkbloom.Renderer | None = None
            for is_alone, group in itertools.groupby(work, key=lambda pair: by_rows(pair[0])):
                files = list(group)
                # Read before the device is opened, so that a wrong file fails at once.
                first = None if is_alone else taken(files[0][0])
                if renderer is None:
                    renderer = stack.enter_context(opened_renderer(adapter, validation))
                    _say(f"Rendering on {renderer.info.summary}", out)
                if first is None:
                    for name, target in files:
                        write_large(renderer, name, target)
                    continue
                prepared = functools.partial(_prepared, renderer, given_with())
                with as_wrong_use():
                    renderer.plan(prepared(first), settings, attachments=wanted)
                ahead = read_ahead(taken, [name for name, _ in files[1:]])
                pictures = itertools.chain([first], ahead)
                results = rendered(renderer, pictures, settings, wanted, prepared)
                del first
                bar = tqdm(
                    results,
                    total=len(files),
                    unit="image",
                    leave=False,
                    disable=disable if several else True,
                )
                with written_behind() as write_next, contextlib.closing(results):
                    for (picture, frames), (name, target) in zip(bar, files, strict=True):
                        if no_bloom.is_without(frames):
                            said = no_bloom.reason(settings, no_bloom.brightest_of(picture.pixels))
                            note(f"{name}: {said}" if several else said)
                        kept = no_bloom.only(frames, names)
                        write_next(functools.partial(write, picture, kept, target))
    if several:
        click.echo(f"wrote {len(work)} images, {work[0][1]} to {work[-1][1]}")


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
    output_colour: SavedColour | None,
    *,
    raw: bool,
) -> None:
    """Raise click.UsageError for options that do not go together."""
    if raw and (input_colour or output_colour):
        raise click.UsageError(
            "--raw does not convert colours; leave out --input-colour and --output-colour"
        )
    if settings.encoding != "none" and settings.alpha != "keep":
        raise click.UsageError(
            f"--alpha {settings.alpha} needs linear colours; leave out --encoding: OUT is encoded "
            "for its format"
        )
    if settings.encoding != "none" and output_colour:
        raise click.UsageError(
            f"--encoding {settings.encoding} already encodes the output; leave out --output-colour"
        )


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


def _say(text: str, out: str) -> None:
    """Print a line on standard output, or on standard error if the picture is on the former."""
    click.echo(text, err=out == PIPE)


def _piped_in(folder: str) -> str:
    """Return a file with the content of standard input, which also tells its format."""
    path = Path(folder, "standard input")
    path.write_bytes(sys.stdin.buffer.read())
    return str(path)


def _written(
    picture: Picture,
    frames: vkbloom.Frames,
    target: Path,
    colour: SavedColour | None,
    quality: int | None,
) -> list[Path]:
    """Write `final` and the other framebuffers, and return the files."""
    written = _save_others(frames, target)
    notes = image_writing.save(
        _result(picture, _straight(picture, frames), frames.settings.encoding),
        target,
        colour,
        {
            "Software": f"vkbloom {vkbloom.__version__}",
            "vkbloom:settings": json.dumps(frames.settings.to_dict()),
        },
        quality,
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


def _result(
    picture: Picture,
    final: NDArray[Any],
    encoding: Encoding,
) -> Picture:
    """Return the picture with its bloom, and with the encoding of the new pixels."""
    done = picture.encoding if encoding == "none" else encoding
    return dataclasses.replace(picture, pixels=final, encoding=done)


def _straight(picture: Picture, frames: vkbloom.Frames) -> NDArray[Any]:
    """Return `final`, divided by alpha if the colours of the file were not multiplied by it."""
    final = frames["final"]
    return divided(final) if frames.settings.alpha != "keep" and has_straight(picture) else final
