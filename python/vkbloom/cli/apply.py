"""``vkbloom apply``: add bloom to an image file."""

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
from vkbloom.cli.program import as_wrong_use
from vkbloom.cli.settings_options import settings_options
from vkbloom.io import image_writing
from vkbloom.io.images import Colour, Picture
from vkbloom.settings import Encoding


@click.command()
@click.argument("source", metavar="IN", type=click.Path())
@click.argument("target", metavar="OUT", type=click.Path())
@click.option(
    "--attachments",
    metavar="all|NAME,...",
    default="final",
    show_default=True,
    help="The framebuffers to write. final is written to OUT; each other framebuffer is written "
    "beside it, as OUT's name with _NAME appended, its values not converted. A framebuffer that "
    "OUT's format cannot hold is written as .exr.",
)
@click.option(
    "--input-colour",
    type=click.Choice(COLOURS),
    help="Encoding of the colours in IN [default linear for floats; srgb for integers, unless "
    "the file says linear]",
)
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
@device_options
@settings_options
def command(
    *,
    source: str,
    target: str,
    attachments: str,
    input_colour: Colour | None,
    output_colour: Colour | None,
    raw: bool,
    subimage: int,
    adapter: str,
    validation: bool,
    settings: vkbloom.Settings,
) -> None:
    """Add bloom to the image IN and write the result to OUT.

    The file extension chooses the format: every format of OpenImageIO, such as OpenEXR, Radiance
    HDR, PNG, JPEG and TIFF.

    Bloom is computed on linear colours. Files of 8-bit or 16-bit integers are decoded from sRGB
    to 32-bit floats, unless the file says that it is linear. Files of floats are read as linear;
    half stays half, and float stays float. --input-colour overrides this.

    OUT has the number type of IN, or the closest one that its format has: a PNG of a float image
    has 8 bits. Integers are encoded to sRGB and clipped to 0..1; floats (as in OpenEXR and
    Radiance HDR) are written linear. --output-colour overrides this. With --encoding, the values
    are already encoded and are written unchanged.

    Alpha is kept, and colours are neither multiplied nor divided by it. A grey image is processed
    as RGB and written as grey. If the data window of an OpenEXR file is smaller than its display
    window, the rest is black; pixels outside the display window are included, and kept if the
    format of OUT has a data window. An image whose file has an orientation is turned upright. If
    a file has several parts, the first is read; --subimage chooses another. Channels other than
    R, G, B and A are ignored.

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
    with as_wrong_use():
        image_writing.check_writable(target)
    picture = read_picture(source, subimage, input_colour, raw=raw)
    with vkbloom.Renderer(adapter, validation=validation) as renderer:
        click.echo(f"Rendering on {renderer.info.summary}")
        names = [name for name in attachments.split(",") if name != "final"]
        with as_wrong_use():
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
