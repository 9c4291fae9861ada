"""The options of a search for settings, and how its results are printed."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from typing import Any, get_args

import click
from rich.console import Console

import vkbloom
from vkbloom._cli.terminal import is_quiet
from vkbloom._explorer.controls import as_code
from vkbloom._fit.losses import LossName


def search_options(
    *, vary: str | None, loss: LossName, max_calls: int
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the options of a search; the arguments are their defaults.

    The command gets `search`, the keyword arguments of `vkbloom.fit` and `vkbloom.translate`, and
    `show_results`, a function that prints results.
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
        @click.option("--json", "as_json", is_flag=True, help="Print one list, sorted by loss.")
        @functools.wraps(command)
        def run(*, vary: str | None, as_json: bool, **rest: Any) -> Any:
            search = {name: rest.pop(name) for name in ("loss", "max_calls")}
            search["progress"] = Console(stderr=True).is_terminal and not is_quiet()
            if vary is not None:
                names = (name.strip().replace("-", "_") for name in vary.split(","))
                search["vary"] = [name for name in names if name]
            show_results = functools.partial(_show_results, as_json=as_json)
            return command(search=search, show_results=show_results, **rest)

        return run

    return add


def _show_results(fits: Sequence[vkbloom.FitResult], *, as_json: bool) -> None:
    """Print results, the best one first."""
    if as_json:
        click.echo(json.dumps([_object(item) for item in fits], indent=2))
    else:
        for item in fits:
            click.echo(
                f"{item.settings.method}: {item.loss_name} loss {item.loss:.4g}, from "
                f"{item.start_loss:.4g}; {item.calls} renders"
            )
            click.echo(f"  {as_code(item.settings)}")
            click.echo(f"  {item.words}")


def _object(fit: vkbloom.FitResult) -> dict[str, Any]:
    """Return the object of one result that --json prints."""
    return {
        "settings": fit.settings.to_dict(),
        "varied": {name: getattr(fit.settings, name) for name in fit.vary},
        "loss": fit.loss,
        "start_loss": fit.start_loss,
        "loss_name": fit.loss_name,
        "explained": fit.explained,
        "verdict": fit.verdict,
        "cause": fit.cause,
        "calls": fit.calls,
    }
