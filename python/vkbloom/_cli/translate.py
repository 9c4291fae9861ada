"""``vkbloom translate``: find another method's parameters whose bloom comes closest to settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click

import vkbloom
from vkbloom._cli.fields import SIZE, Command, NameOf
from vkbloom._cli.program import adapter_option, as_wrong_use, given
from vkbloom._cli.search_options import search_options
from vkbloom._cli.settings_options import STARTS, settings_options
from vkbloom._renderer.interruptible import opened_renderer
from vkbloom._settings.registry import METHODS


@click.command(cls=Command)
@click.option(
    "--to",
    "target",
    required=True,
    type=NameOf("preset or method", vkbloom.presets, METHODS),
    help="A preset or a method: where the search starts, and what does not vary.",
)
@click.option("--size", type=SIZE, default="640x360", help="Size of the picture.")
@search_options(vary=None, loss="log", max_calls=300)
@adapter_option
@settings_options
def command(
    *,
    target: str,
    size: tuple[int, int],
    search: dict[str, Any],
    show_results: Callable[[Sequence[vkbloom.FitResult]], None],
    adapter: str,
    settings: vkbloom.Settings,
) -> None:
    """Find another method's parameters whose bloom comes closest.

    --preset, --method or --settings, with further options, are the settings to translate; --to
    names the other method. Both get a black picture with four small lights. The result is printed
    as Python code, with its loss and a verdict.
    """
    if not any(given(name) for name in STARTS):
        raise click.UsageError(
            "give what to translate: --preset NAME, --method NAME or --settings FILE"
        )
    start = vkbloom.presets[target] if target in vkbloom.presets else METHODS[target]()
    with opened_renderer(adapter) as renderer, as_wrong_use():
        result = vkbloom.translate(settings, start, size=size, renderer=renderer, **search)
    show_results([result])
