"""``vkbloom fit``: find the settings whose bloom matches a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom._cli.fields import Command, NameOf
from vkbloom._cli.image_files import input_colour_option, is_photograph, read_picture
from vkbloom._cli.program import adapter_option, as_wrong_use
from vkbloom._cli.search_options import search_options
from vkbloom._cli.settings_options import PRESET_OF_IMAGES, PRESET_OF_PHOTOS
from vkbloom._cli.terminal import note
from vkbloom._io.expansion import PHOTO_EXPANSION
from vkbloom._renderer.interruptible import opened_renderer
from vkbloom._settings.registry import METHODS


@click.command(cls=Command)
@click.argument("image", metavar="IMAGE", type=click.Path())
@click.argument("target", metavar="TARGET", type=click.Path())
@click.option(
    "--preset",
    "presets",
    multiple=True,
    type=NameOf("preset", vkbloom.presets, ("all",)),
    help="Settings to start a search from; may be repeated. all: every preset, each with those of "
    f"the varied settings that it has [default {PRESET_OF_IMAGES}]",
)
@click.option(
    "--method",
    "kinds",
    multiple=True,
    type=NameOf("method", METHODS),
    help="A method whose defaults start a search; may be repeated.",
)
@search_options(vary="threshold,intensity", loss="relative", max_calls=1000)
@input_colour_option
@adapter_option
def command(
    *,
    image: str,
    target: str,
    presets: tuple[str, ...],
    kinds: tuple[str, ...],
    search: dict[str, Any],
    show_results: Callable[[Sequence[vkbloom.FitResult]], None],
    input_colour: Any,
    adapter: str,
) -> None:
    """Find the settings with which the bloom of IMAGE matches TARGET.

    Both files have the same size. Their colours are decoded to linear light, as by vkbloom apply.
    With a TARGET of 8 bits, such as a screenshot, blooms are clipped and rounded as it is. For the
    preset photo, the highlights of an IMAGE of integers are also expanded.

    There is one search for each preset and method, which starts from its settings. --vary names
    the settings that may change. The results are printed as Python code, sorted by loss, with a
    verdict (good, fair or poor) and the likely cause, such as a target without bloom.
    """
    pixels = read_picture(image, 0, input_colour).pixels
    wanted = read_picture(target, 0, input_colour).pixels
    searches = _searches(presets, kinds, pixels)
    if is_photograph(image) and (photo := _photo_of(presets, search["vary"])):
        bright = read_picture(image, 0, input_colour, expand=PHOTO_EXPANSION).pixels
        searches.append((bright, [photo]))
        note(f"{image}: its highlights are expanded to {PHOTO_EXPANSION:g} for the preset photo")
    with opened_renderer(adapter) as renderer, as_wrong_use():
        results = [
            item
            for image_of, begun in searches
            for item in vkbloom.fit(image_of, wanted, begun, renderer=renderer, **search)
        ]
    show_results(sorted(results, key=lambda item: item.loss))


def _searches(
    presets: Sequence[str], kinds: Sequence[str], pixels: NDArray[Any]
) -> list[tuple[NDArray[Any], Any]]:
    """Return what `vkbloom.fit` gets of each search: the image, and the settings."""
    begun = [METHODS[kind]() for kind in kinds]
    if "all" in presets:
        return [(pixels, "all"), *([(pixels, begun)] if begun else [])]
    begun += [vkbloom.presets[name] for name in presets]
    return [(pixels, begun or [vkbloom.presets[PRESET_OF_IMAGES]])]


def _photo_of(presets: Sequence[str], vary: Sequence[str]) -> vkbloom.Settings | None:
    """Return the preset for photographs if it is asked for and has the varied fields."""
    photo = vkbloom.presets[PRESET_OF_PHOTOS]
    is_asked = "all" in presets or PRESET_OF_PHOTOS in presets
    return photo if is_asked and all(hasattr(photo, name) for name in vary) else None
