"""``vkbloom fit``: find the settings whose bloom matches a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click

import vkbloom
from vkbloom.cli.device_options import device_options
from vkbloom.cli.fields import Command, NameOf
from vkbloom.cli.image_files import input_colour_option, layer_option, read_picture
from vkbloom.cli.program import as_wrong_use
from vkbloom.cli.search_options import search_options
from vkbloom.cli.settings_options import PRESET_OF_IMAGES, read_settings
from vkbloom.cli.terminal import detail_device
from vkbloom.interruptible import opened_renderer
from vkbloom.registry import METHODS


@click.command(cls=Command)
@click.argument("image", metavar="IMAGE", type=click.Path())
@click.argument("target", metavar="TARGET", type=click.Path())
@click.option(
    "--preset",
    "presets",
    multiple=True,
    type=NameOf("preset", vkbloom.presets),
    help=f"Settings to start a search from; may be repeated [default {PRESET_OF_IMAGES}]",
)
@click.option(
    "--method",
    "kinds",
    multiple=True,
    type=NameOf("method", METHODS),
    help="A method whose defaults start a search; may be repeated.",
)
@click.option(
    "--settings",
    "files",
    metavar="FILE",
    multiple=True,
    type=click.Path(),
    help="A file of settings to start a search from, as for vkbloom apply; may be repeated.",
)
@click.option(
    "--framebuffer",
    metavar="NAME",
    default="final",
    show_default=True,
    help="The framebuffer that TARGET shows: final is the picture with its bloom, bloom the bloom "
    "alone.",
)
@search_options(vary="threshold,intensity", loss="relative", max_calls=1000)
@input_colour_option
@layer_option
@device_options
def command(
    *,
    image: str,
    target: str,
    presets: tuple[str, ...],
    kinds: tuple[str, ...],
    files: tuple[str, ...],
    framebuffer: str,
    search: dict[str, Any],
    told: Callable[[Sequence[vkbloom.FitResult]], int],
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
    begun = [*(vkbloom.presets[name] for name in presets), *(METHODS[kind]() for kind in kinds)]
    begun += [read_settings(file)[0] for file in files]
    begun = begun or [vkbloom.presets[PRESET_OF_IMAGES]]
    pixels, wanted = (
        read_picture(file, 0, input_colour, layer=layer).pixels for file in (image, target)
    )
    with opened_renderer(adapter, validation) as renderer, as_wrong_use():
        detail_device(renderer)
        found = vkbloom.fit(
            pixels, wanted, begun, framebuffer=framebuffer, renderer=renderer, **search
        )
    return told(found)
