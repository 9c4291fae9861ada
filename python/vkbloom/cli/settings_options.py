"""The options of the settings: ``--method``, ``--preset``, and one for each field."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, Final

import click

import vkbloom
from vkbloom.cli import fields
from vkbloom.cli.program import as_wrong_use

#: Settings class of each method, by the method's name.
METHODS: Final[dict[str, type[vkbloom.Settings]]] = {
    kind.method: kind for kind in vkbloom.Settings.__subclasses__()
}
_DEFAULT_METHOD: Final = vkbloom.Separable.method


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the settings to a command; its argument `settings` has the result."""

    @click.option(
        "--preset",
        type=click.Choice(list(vkbloom.presets)),
        help="Published settings to start from; other options change them.",
    )
    @click.option(
        "--method",
        type=click.Choice(list(METHODS)),
        help=f"How the bloom is blurred [default {_DEFAULT_METHOD}, or the preset's]",
    )
    @fields.options({"": vkbloom.Settings}, "shared")
    @fields.options(dict(METHODS), "own", base=vkbloom.Settings)
    @functools.wraps(command)
    def run(
        preset: str | None,
        method: str | None,
        shared: dict[str, Any],
        own: dict[str, Any],
        **rest: object,
    ) -> object:
        return command(settings=_settings(preset, method, {**shared, **own}), **rest)

    return run


def _settings(preset: str | None, method: str | None, changes: dict[str, Any]) -> vkbloom.Settings:
    """Make settings from the options.

    Raises
    ------
    click.UsageError
        The options contradict each other, or a value is out of range.
    """
    begun = METHODS[method or _DEFAULT_METHOD]() if preset is None else vkbloom.presets[preset]
    if method not in (None, begun.method):
        raise click.UsageError(
            f"--method: the preset {preset} has the method {begun.method}, not {method}"
        )
    foreign = [name for name in changes if name not in begun.as_dict()]
    if foreign:
        declared = {one.name: one for kind in METHODS.values() for one in dataclasses.fields(kind)}
        options = (declared[name].metadata.get("option", name) for name in foreign)
        names = ", ".join(f"--{option.replace('_', '-')}" for option in options)
        raise click.UsageError(f"the method {begun.method} has no {names}")
    with as_wrong_use():
        return begun.replace(**changes)
