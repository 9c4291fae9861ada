"""``vkbloom apply``: an image file gets bloom."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom.cli.device_options import device_options
from vkbloom.cli.image_files import COLOURS, note, read_picture, subimage_option
from vkbloom.cli.program import blaming_the_call
from vkbloom.cli.settings_options import settings_options
from vkbloom.io import image_writing
from vkbloom.io.images import Colour, Picture, SavedColour
from vkbloom.settings import Encoding


@click.command()
@click.argument("source", metavar="IN", type=click.Path())
@click.argument("target", metavar="OUT", type=click.Path())
@click.option(
    "--attachments",
    metavar="all|NAME,...",
    default="final",
    show_default=True,
    help="The framebuffers wanted. final is OUT; each other is written beside it as OUT's name "
    "with _NAME, its values as they are, and as .exr where OUT's format cannot hold them.",
)
@click.option(
    "--input-colour",
    type=click.Choice(COLOURS),
    help="What the colours in IN are [default linear for floats; for integers srgb, unless the "
    "file says linear]",
)
@click.option(
    "--output-colour",
    type=click.Choice(COLOURS),
    help="What the colours in OUT shall be [default linear for floats, srgb for integers]",
)
@click.option(
    "--raw",
    is_flag=True,
    help="Take the values of an 8-bit file as they are, without decoding, through 8-bit buffers, "
    "and write them so.",
)
@subimage_option
@device_options
@settings_options
def command(
    *,
    source: str,
    target: str,
    attachments: str,
    input_colour: Colour | None,
    output_colour: SavedColour | None,
    raw: bool,
    subimage: int,
    adapter: str,
    validation: bool,
    settings: vkbloom.Settings,
) -> None:
    """Give the image IN bloom and write it to OUT.

    The formats are those of OpenImageIO, by extension: OpenEXR, Radiance HDR, PNG, JPEG, TIFF and
    others.

    Colours are linear while they bloom. Files of 8 or 16 bit integers are decoded from sRGB to
    32-bit floats, unless they say that they are linear. Files of floats are taken as linear;
    half stays half, and float stays float. --input-colour says otherwise.

    OUT holds the same numbers as IN, or the next best that its format has: a PNG of a float image
    has 8 bits. Integers are encoded to sRGB and clipped to 0..1; floats (as in OpenEXR and
    Radiance HDR) are written linear. --output-colour says otherwise. With an --encoding, the
    values are encoded already and written as they come.

    Alpha is kept, and colours are neither multiplied nor divided by it. Grey images become RGB
    and grey again. Of an OpenEXR file whose data window is smaller than its display window, the
    rest is black; a larger data window takes part, and is kept where OUT can have one. Images
    are turned upright where the file has an orientation. Of files with several parts the first
    is read, or --subimage; channels other than R, G, B and A are left out.

    OUT is replaced when it is complete; nothing is left of one that failed.
    """
    if raw and (input_colour or output_colour):
        raise click.UsageError(
            "--raw leaves colours as they are, so neither --input-colour nor "
            "--output-colour goes with it"
        )
    if settings.encoding != "none" and output_colour:
        raise click.UsageError(
            f"the encoding {settings.encoding} says what the output's colours are, so "
            "--output-colour does not go with it"
        )
    with blaming_the_call():
        image_writing.check_writable(target)
    picture = read_picture(source, subimage, input_colour, raw=raw)
    with vkbloom.Renderer(adapter, validation=validation) as renderer:
        click.echo(f"Rendering on {renderer.info.summary}")
        names = [name for name in attachments.split(",") if name != "final"]
        with blaming_the_call():
            frames = renderer.apply(
                picture.pixels,
                settings,
                attachments="all" if attachments == "all" else ["final", *names],
            )
    written = _save_others(frames, Path(target))
    notes = image_writing.save(
        _result(picture, frames["final"], settings.encoding),
        target,
        output_colour,
        {
            "Software": f"vkbloom {vkbloom.__version__}",
            "vkbloom:settings": json.dumps(settings.as_dict()),
        },
    )
    for text in notes:
        note(text)
    for path in (target, *written):
        click.echo(f"wrote {path}")


def _save_others(frames: vkbloom.Frames, target: Path) -> list[Path]:
    """Write all framebuffers but final, each into a file of its own."""
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
    """Return the picture with its bloom, encoded or as it came."""
    done = picture.encoding if encoding == "none" else encoding
    return dataclasses.replace(picture, pixels=final, encoding=done)
