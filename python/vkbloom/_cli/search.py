"""``vkbloom fit``, ``translate``: search settings."""

from __future__ import annotations

import contextlib
import functools
import json
import math
from collections.abc import Callable, Sequence
from typing import Any, get_args

import click
from rich.console import Console

from vkbloom import _fit
from vkbloom._cli.fields import SIZE, Command, NameOf
from vkbloom._cli.image_files import input_colour_option, read_picture
from vkbloom._cli.program import adapter_option, as_wrong_use, is_given
from vkbloom._cli.settings_options import STARTS, read_settings, settings_options
from vkbloom._cli.terminal import Form, is_quiet, json_option, note
from vkbloom._explorer.controls import as_code
from vkbloom._fit import FitResult
from vkbloom._fit.losses import LossName
from vkbloom._fit.translating import Translation
from vkbloom._io.picture import Highlights, Picture
from vkbloom._presets.start import (
    PRESET_OF_IMAGES,
    PRESET_OF_PHOTOS,
    Start,
    start_of,
)
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import Settings, presets


def _search_options(
    *, vary: str | None, loss: LossName, max_calls: int
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the options of a search; the arguments are their defaults.

    The command gets `search`, the keyword arguments of `vkbloom.fit` and `vkbloom.translate`, and
    returns results, which are printed.
    """

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        @click.option(
            "--vary",
            metavar="NAME,...",
            default=vary,
            help="The settings to find: numbers, switches and choices"
            + ("." if vary else " [default: width and strength of the blur, threshold, intensity]"),
        )
        @click.option(
            "--loss",
            type=click.Choice(get_args(LossName)),
            default=loss,
            help="The figure to minimize. relative: norm of the difference divided by the norm of "
            "the target; l2: root mean square of the difference; log: the same for logarithms; "
            "flip: mean FLIP.",
        )
        @click.option(
            "--max-calls",
            metavar="N",
            type=click.IntRange(min=1),
            default=max_calls,
            help="Limit of the renders of each search.",
        )
        @json_option("Print one list, sorted by loss.")
        @functools.wraps(command)
        def run(*, vary: str | None, form: Form, **rest: Any) -> None:
            search = {name: rest.pop(name) for name in ("loss", "max_calls")}
            search["progress"] = Console(stderr=True).is_terminal and not is_quiet()
            if vary is not None:
                names = (name.strip().replace("-", "_") for name in vary.split(","))
                search["vary"] = [name for name in names if name]
            _show_results(command(search=search, **rest), form)

        return run

    return add


def _show_results(fits: Sequence[FitResult], form: Form) -> None:
    """Print results, the best one first."""
    if form == "json":
        objects = [_object(item) for item in fits]
        for item, one in zip(fits, objects, strict=True):
            if _has_intervals(item, fits):
                one["intervals"] = _intervals_of(item)
                one["undetermined"] = list(item.undetermined) if one["intervals"] else []
        click.echo(json.dumps(objects, indent=2))
    else:
        for item in fits:
            click.echo(
                f"{item.settings.method}: {item.loss_name} loss {item.loss:.4g}, from "
                f"{item.start_loss:.4g}; {item.calls} renders"
            )
            is_translation = isinstance(item, Translation)
            settings = _in_four_digits(item) if is_translation else item.settings
            click.echo(f"  {as_code(settings)}")
            click.echo(f"  {item.words}")
            if _has_intervals(item, fits):
                click.echo(f"  {item.summary}")


def _has_intervals(fit: FitResult, fits: Sequence[FitResult]) -> bool:
    """Return whether intervals are printed: of what is close, and of the best."""
    return fit is fits[0] or fit.verdict != "poor"


def _find_intervals(fits: Sequence[FitResult]) -> list[FitResult]:
    """Return results, sorted by loss, whose intervals are known before the renderer is closed."""
    ordered = sorted(fits, key=lambda item: item.loss)
    for item in ordered:
        if _has_intervals(item, ordered):
            _ = item.summary, _intervals_of(item)
    return ordered


def _intervals_of(fit: FitResult) -> dict[str, list[float | None]]:
    """Return the intervals of 95 % as JSON has them: None for an end that is not determined."""
    intervals: dict[str, list[float | None]] = {}
    for name in fit.vary:
        with contextlib.suppress(ValueError):  # a choice, or a loss without intervals
            ends = fit.interval(name)
            intervals[name] = [end if math.isfinite(end) else None for end in ends]
    return intervals


def _in_four_digits(fit: FitResult) -> Settings:
    """Return the settings of a translation as they are printed: no more digits tell anything."""
    settings = fit.settings
    for name in fit.vary:
        value = settings.value_of(name)
        if isinstance(value, float):
            with contextlib.suppress(ValueError):  # beyond the end of the range
                settings = settings.replace(**{name: float(f"{value:.4g}")})
    return settings


def _object(fit: FitResult) -> dict[str, Any]:
    """Return the object of one result that --json prints."""
    return {
        "settings": fit.settings.to_dict(),
        "varied": {name: fit.settings.value_of(name) for name in fit.vary},
        "loss": fit.loss,
        "start_loss": fit.start_loss,
        "loss_name": fit.loss_name,
        "explained": fit.explained,
        "verdict": fit.verdict,
        "cause": fit.cause,
        "calls": fit.calls,
    }


@click.command(cls=Command)
@click.argument("image", metavar="IMAGE", type=click.Path())
@click.argument("target", metavar="TARGET", type=click.Path())
@click.option(
    "--preset",
    "presets",
    multiple=True,
    type=NameOf("preset", presets, ("all",)),
    help="Settings to start a search from; may be repeated. all: every preset, each with those of "
    f"the varied settings that it has [default {PRESET_OF_IMAGES}; {PRESET_OF_PHOTOS} for files of "
    "integers]",
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
    "stored",
    metavar="FILE",
    type=click.Path(),
    help="A file of settings that start a search, as of vkbloom apply.",
)
@_search_options(vary="threshold,intensity", loss="relative", max_calls=1000)
@input_colour_option
@adapter_option
def fit(
    *,
    image: str,
    target: str,
    presets: tuple[str, ...],
    kinds: tuple[str, ...],
    stored: str | None,
    search: dict[str, Any],
    input_colour: Any,
    adapter: str,
) -> list[FitResult]:
    """Find the settings with which the bloom of IMAGE matches TARGET.

    Both files have the same size. Their colours are decoded to linear light, as by vkbloom apply;
    an IMAGE of integers is also expanded for the settings for which vkbloom apply expands it, such
    as the preset photo. With a TARGET of 8 bits, such as a screenshot, blooms are clipped and
    rounded as it is.

    There is one search for each preset and method, and for --settings, which starts from its
    settings. --vary names the settings that may change. The results are printed as Python code,
    sorted by loss, with a verdict (good, fair or poor) and the likely cause, such as a target
    without bloom, and with the intervals of 95 % of the settings that were varied.
    """
    picture = read_picture(image, 0, input_colour)
    wanted = read_picture(target, 0, input_colour).pixels
    begun = _list_starts(picture.highlights, presets, kinds, stored)
    searches: list[tuple[Picture, Any]] = []
    if "all" in presets:
        searches.append((picture, "all"))
        photo = start_of(picture.highlights, PRESET_OF_PHOTOS)
        if photo.expand and all(hasattr(photo.settings, name) for name in search["vary"]):
            begun.append(photo)
    for start in begun:
        if start.expand is not None:
            method = start.settings.method
            note(f"{image}: its highlights are expanded to {start.expand:g} for {method}")
        searches.append((start.develop(picture), [start.settings]))
    with open_renderer(adapter) as renderer, as_wrong_use():
        return _find_intervals(
            [
                item
                for source, settings in searches
                for item in _fit.fit(source.pixels, wanted, settings, renderer=renderer, **search)
            ]
        )


def _list_starts(
    highlights: Highlights, presets: Sequence[str], kinds: Sequence[str], stored: str | None
) -> list[Start]:
    """Return where the searches start that are named one by one."""
    begun = [start_of(highlights, METHODS[kind]()) for kind in kinds]
    begun += [start_of(highlights, name) for name in presets if name != "all"]
    if stored is not None:
        held = read_settings(stored)
        begun.append(start_of(highlights, held.settings, expand=held.expand))
    return begun if begun or "all" in presets else [start_of(highlights)]


@click.command(cls=Command)
@click.option(
    "--to",
    "target",
    required=True,
    type=NameOf("preset or method", presets, METHODS),
    help="A preset or a method: where the search starts, and what does not vary.",
)
@click.option("--size", type=SIZE, default="640x360", help="Size of the picture.")
@_search_options(vary=None, loss="log", max_calls=300)
@adapter_option
@settings_options
def translate(
    *,
    target: str,
    size: tuple[int, int],
    search: dict[str, Any],
    adapter: str,
    settings: Settings,
) -> list[FitResult]:
    """Find another method's parameters whose bloom comes closest.

    --preset, --method or --settings, with further options, are the settings to translate; --to
    names the other method. Both get a black picture with four small lights. The result is printed
    as Python code, with numbers of four digits, its loss, a verdict (good, fair or poor, by the
    loss alone) and what differs.
    """
    if not any(is_given(name) for name in STARTS):
        raise click.UsageError(
            "give what to translate: --preset NAME, --method NAME or --settings FILE"
        )
    start = presets[target] if target in presets else METHODS[target]()
    with open_renderer(adapter) as renderer, as_wrong_use():
        found = _fit.translate(settings, start, size=size, renderer=renderer, **search)
        return _find_intervals([found])
