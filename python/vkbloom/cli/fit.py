"""``vkbloom fit``: find the settings whose bloom matches a picture."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import click
from rich.console import Console

import vkbloom
from vkbloom.cli.axis_options import axis_bounds
from vkbloom.cli.device_options import device_options
from vkbloom.cli.fields import NameOf
from vkbloom.cli.image_files import input_colour_option, layer_option, note, read_picture
from vkbloom.cli.program import as_wrong_use
from vkbloom.cli.settings_options import PRESET_OF_IMAGES
from vkbloom.explorer.controls import as_code
from vkbloom.fits.losses import LossName
from vkbloom.interruptible import opened_renderer
from vkbloom.io import safe_writing
from vkbloom.registry import METHODS


@click.command()
@click.argument("image", metavar="IMAGE", type=click.Path())
@click.argument("target", metavar="TARGET", type=click.Path())
@click.option(
    "--preset",
    "presets",
    multiple=True,
    type=click.Choice(list(vkbloom.presets)),
    help=f"Settings to start a search from; may be repeated [default {PRESET_OF_IMAGES}]",
)
@click.option(
    "--method",
    "kinds",
    multiple=True,
    type=NameOf(METHODS),
    help="A method whose defaults start a search; may be repeated.",
)
@click.option(
    "--vary",
    metavar="NAME,...",
    default="threshold,intensity",
    show_default=True,
    help="The settings to find: numbers, switches and choices.",
)
@click.option(
    "--bounds",
    metavar="NAME=LOW:HIGH",
    multiple=True,
    help="A narrower range for one of these settings; may be repeated.",
)
@click.option(
    "--framebuffer",
    metavar="NAME",
    default="final",
    show_default=True,
    help="The framebuffer that TARGET shows: final is the picture with its bloom, bloom the bloom "
    "alone.",
)
@click.option(
    "--loss",
    type=click.Choice(get_args(LossName)),
    default="relative",
    show_default=True,
    help="The figure to minimize. relative: norm of the difference divided by the norm of TARGET; "
    "l2: root mean square of the difference; log: the same for logarithms; flip: mean FLIP.",
)
@click.option(
    "--max-calls",
    metavar="N",
    type=click.IntRange(min=1),
    default=1000,
    show_default=True,
    help="Limit of the renders of each search.",
)
@click.option(
    "--max-loss",
    metavar="X",
    type=click.FloatRange(min=0),
    help="Exit status 1 if the smallest loss is larger [default: any loss is status 0]",
)
@click.option(
    "-o",
    "--out",
    metavar="REPORT",
    type=click.Path(),
    help="Write the pictures, radial profiles and losses as an HTML file.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one list, sorted by loss.")
@input_colour_option
@layer_option
@device_options
def command(
    *,
    image: str,
    target: str,
    presets: tuple[str, ...],
    kinds: tuple[str, ...],
    vary: str,
    bounds: tuple[str, ...],
    framebuffer: str,
    loss: LossName,
    max_calls: int,
    max_loss: float | None,
    out: str | None,
    as_json: bool,
    input_colour: Any,
    layer: str | None,
    adapter: str,
    validation: bool,
) -> int:
    """Find the settings with which the bloom of IMAGE matches TARGET.

    Both files have the same size. Their colours are decoded to linear light, as by vkbloom apply.
    There is one search for each preset and method, which starts from its settings. --vary names the
    settings that may change. The results are printed as Python code, sorted by loss,
    with a verdict (good, fair or poor) and the likely cause, such as a clipped target.
    """
    names = [name.strip().replace("-", "_") for name in vary.split(",") if name.strip()]
    begun = [*(vkbloom.presets[name] for name in presets), *(METHODS[kind]() for kind in kinds)]
    begun = begun or [vkbloom.presets[PRESET_OF_IMAGES]]
    pixels, wanted = (
        read_picture(file, 0, input_colour, layer=layer).pixels for file in (image, target)
    )
    with opened_renderer(adapter, validation) as renderer, as_wrong_use():
        found = vkbloom.fit(
            pixels,
            wanted,
            begun,
            names,
            framebuffer=framebuffer,
            loss=loss,
            bounds=axis_bounds(bounds),
            renderer=renderer,
            max_calls=max_calls,
            progress=Console(stderr=True).is_terminal,
        )
    if as_json:
        click.echo(json.dumps([_object(one) for one in found], indent=2))
    else:
        for one in found:
            click.echo(
                f"{one.settings.method}: {one.loss_name} loss {one.loss:.4g}, from "
                f"{one.start_loss:.4g}; {one.calls} renders in {one.seconds:.1f} s"
            )
            click.echo(f"  {as_code(one.settings)}")
            click.echo(f"  {one.words}")
    if out is not None:
        _write(found, Path(out))
        click.echo(f"wrote {out}", err=as_json)
    if max_loss is not None and found[0].loss > max_loss:
        note(f"the smallest loss, {found[0].loss:.4g}, is over --max-loss {max_loss:g}")
        return 1
    return 0


def _object(found: vkbloom.FitResult) -> dict[str, Any]:
    """Return the object of one result that --json prints."""
    return {
        "settings": found.settings.to_dict(),
        "varied": {name: getattr(found.settings, name) for name in found.vary},
        "loss": found.loss,
        "start_loss": found.start_loss,
        "loss_name": found.loss_name,
        "verdict": found.verdict,
        "cause": found.cause,
        "calls": found.calls,
        "seconds": found.seconds,
    }


def _write(found: Sequence[vkbloom.FitResult], path: Path) -> None:
    """Write the reports of all results as one page."""
    reports = "<hr>".join(one._repr_html_() for one in found)
    page = (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>vkbloom fit</title>'
        f'<body style="font-family:sans-serif">{reports}</body></html>'
    )
    safe_writing.write_file(path, page.encode())
