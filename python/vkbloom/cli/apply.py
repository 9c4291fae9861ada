"""``vkbloom apply``: add bloom to an image file."""

from __future__ import annotations

import dataclasses
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom
from vkbloom.cli.device_options import device_options
from vkbloom.cli.fields import Command
from vkbloom.cli.image_files import (
    COLOURS,
    input_colour_option,
    layer_option,
    note,
    read_picture,
    subimage_option,
)
from vkbloom.cli.program import as_wrong_use
from vkbloom.cli.sequences import PIPE, pairs
from vkbloom.cli.settings_options import settings_options
from vkbloom.io import image_writing
from vkbloom.io.images import Colour, Picture, SavedColour
from vkbloom.settings import Encoding


@click.command(cls=Command)
@click.argument("sources", metavar="IN... OUT", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o", "--out", metavar="OUT", type=click.Path(), help="The file to write, in place of OUT."
)
@click.option(
    "--quality",
    metavar="N",
    type=click.IntRange(1, 100),
    help="Of JPEG, WebP and JPEG XL [default 98 of JPEG]",
)
@click.option(
    "--pipe-format",
    metavar="EXTENSION",
    default="png",
    show_default=True,
    help="What is written to standard output.",
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
@subimage_option
@layer_option
@device_options
@settings_options
def command(
    *,
    sources: tuple[str, ...],
    out: str | None,
    quality: int | None,
    pipe_format: str,
    attachments: str,
    input_colour: Colour | None,
    output_colour: SavedColour | None,
    raw: bool,
    subimage: int,
    layer: str | None,
    adapter: str,
    validation: bool,
    settings: vkbloom.Settings,
) -> None:
    """Add bloom to the image IN and write the result to OUT.

    The formats are those of OpenImageIO, by extension: OpenEXR, Radiance HDR, PNG, JPEG, TIFF and
    others. IN and OUT may be folders, where names are kept, or printf patterns (f.%04d.exr); IN
    may be a glob as well, or several files, and either may be - for a pipe.

    Without --preset and --method the settings are those of bevy_natural, which other options
    change.

    Colours are linear while they bloom. Files of 8 or 16 bit integers are decoded to 32-bit
    floats of Rec. 709 colours by their ICC profile, their cICP chunk or their gamma, else from
    sRGB. Files of floats are taken as linear; half stays half, and float stays float.
    --input-colour says otherwise.

    OUT has the number type of IN, or the closest one that its format has: a PNG of a float image
    has 8 bits. Integers are encoded to sRGB and clipped to 0..1; floats (as in OpenEXR and
    Radiance HDR) are written linear. --output-colour says otherwise. With an --encoding, the
    values are encoded already and written as they come. EXIF, resolution and a JPEG's chroma
    subsampling are kept.

    Alpha is kept, and colours are neither multiplied nor divided by it. Grey images become RGB
    and grey again. Of an OpenEXR file whose data window is smaller than its display window, the
    rest is black; a larger data window takes part, and is kept where OUT can have one. Images
    are turned upright where the file has an orientation. Of files with several parts the first
    is read, or --subimage, and of several layers the one that --layer names; channels other than
    R, G, B and A are left out.

    OUT is replaced only when the new file is complete. A call that fails leaves no partial file.
    """
    if raw and (input_colour or output_colour):
        raise click.UsageError(
            "--raw does not convert colours; leave out --input-colour and --output-colour"
        )
    if settings.encoding != "none" and output_colour:
        raise click.UsageError(
            f"--encoding {settings.encoding} already encodes the output; leave out --output-colour"
        )
    given, out = _arguments(sources, out)
    if out == PIPE and attachments != "final":
        raise click.UsageError("standard output takes final alone, without --attachments")
    work = pairs(given, out)
    with as_wrong_use():
        for name in {f"image{Path(target).suffix}" for _, target in work}:
            checked = f"image.{pipe_format}" if out == PIPE else name
            image_writing.check_writable(checked)
            image_writing.check_quality(checked, quality)
    with tempfile.TemporaryDirectory() as folder:

        def taken(source: str) -> Picture:
            file = _piped_in(folder) if source == PIPE else source
            return read_picture(file, subimage, input_colour, layer=layer, raw=raw)

        # Before the device is opened: the most likely failure comes at once.
        picture = taken(work[0][0])
        piped = Path(folder, f"output.{pipe_format}")
        # None: shown where standard error is a terminal.
        disable = True if len(work) == 1 or sys.stderr is None else None
        with vkbloom.Renderer(adapter, validation=validation) as renderer:
            _say(f"Rendering on {renderer.info.summary}", out)
            for index, (source, target) in enumerate(
                tqdm(work, unit="image", leave=False, disable=disable)
            ):
                picture = taken(source) if index else picture
                frames = _applied(renderer, picture, settings, attachments)
                if len(work) > 1:
                    Path(target).parent.mkdir(exist_ok=True)
                file = piped if out == PIPE else Path(target)
                written = _written(picture, frames, file, output_colour, quality)
                if out == PIPE:
                    sys.stdout.buffer.write(piped.read_bytes())
                elif len(work) == 1:
                    for path in written:
                        click.echo(f"wrote {path}")
    if len(work) > 1:
        click.echo(f"wrote {len(work)} images, {work[0][1]} to {work[-1][1]}")


def _arguments(sources: tuple[str, ...], out: str | None) -> tuple[list[str], str]:
    """Return the INs and OUT, which is the last argument or that of --out."""
    if out is not None:
        return [*sources], out
    if len(sources) < 2:
        raise click.UsageError("Missing argument 'OUT'.")
    return [*sources[:-1]], sources[-1]


def _say(text: str, out: str) -> None:
    """Print a line where it is not in the way of a picture on standard output."""
    click.echo(text, err=out == PIPE)


def _piped_in(folder: str) -> str:
    """Return a file with what comes from standard input; formats are told by their content."""
    path = Path(folder, "standard input")
    path.write_bytes(sys.stdin.buffer.read())
    return str(path)


def _applied(
    renderer: vkbloom.Renderer, picture: Picture, settings: vkbloom.Settings, attachments: str
) -> vkbloom.Frames:
    """Return the frames that are to be written, and say where there is no bloom in them."""
    names = [name for name in attachments.split(",") if name != "final"]
    wanted = ["final", *names] if attachments != "all" else []
    # To know whether it is zero, unless it was turned off.
    looked_at = ["bloom"] if wanted and settings.bloom and "bloom" not in names else []
    with as_wrong_use():
        frames = renderer.apply(
            picture.pixels, settings, attachments=[*wanted, *looked_at] or "all"
        )
    if settings.bloom and not frames["bloom"][:, :, :3].any():
        note(_about_no_bloom(picture.pixels, settings))
    if not looked_at:
        return frames
    return vkbloom.Frames(
        {name: array for name, array in frames.items() if name != "bloom"},
        timings=frames.timings,
        settings=frames.settings,
        info=frames.info,
    )


def _about_no_bloom(pixels: NDArray[Any], settings: vkbloom.Settings) -> str:
    """Say why the bloom of an image may be zero everywhere."""
    colours = pixels[:, :, :3]
    scale = np.float32(255 if pixels.dtype == np.uint8 else 1)
    brightest = float(np.max(colours, initial=0, where=np.isfinite(colours)) / scale)
    known = f"the brightest value is {brightest:.3g}"
    if settings.threshold is None:
        return f"the bloom is zero everywhere; {known}"
    return (
        f"the bloom is zero everywhere: nothing lies above the threshold {settings.threshold:g}; "
        f"{known}"
    )


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
        _result(picture, frames["final"], frames.settings.encoding),
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
    """Return the picture with its bloom, with the encoding that its pixels now have."""
    done = picture.encoding if encoding == "none" else encoding
    return dataclasses.replace(picture, pixels=final, encoding=done)
