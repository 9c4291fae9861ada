"""The options that choose a bloom: ``--method``, ``--preset``, and each field of the settings."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, Final

import click

import vkbloom
from vkbloom.cli import fields
from vkbloom.cli.program import blaming_the_call

#: The settings of each method, by its name.
METHODS: Final[dict[str, type[vkbloom.Settings]]] = {
    kind.method: kind for kind in vkbloom.Settings.__subclasses__()
}
_DEFAULT_METHOD: Final = vkbloom.Separable.method


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the settings to a command, which gets them as `settings`."""

    @click.option(
        "--preset",
        type=click.Choice(list(vkbloom.presets)),
        help="Settings to begin with, under the name of where they were published.",
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
    """Return the settings that the options ask for.

    Raises
    ------
    click.UsageError
        The options contradict each other, or a value is out of range.
    """
    begun = METHODS[method or _DEFAULT_METHOD]() if preset is None else vkbloom.presets[preset]
    if method not in (None, begun.method):
        raise click.UsageError(f"--preset {preset} is of the method {begun.method}, not {method}")
    foreign = [name for name in changes if name not in begun.as_dict()]
    if foreign:
        declared = {one.name: one for kind in METHODS.values() for one in dataclasses.fields(kind)}
        options = (declared[name].metadata.get("option", name) for name in foreign)
        names = ", ".join(f"--{option.replace('_', '-')}" for option in options)
        raise click.UsageError(f"the method {begun.method} has no {names}")
    with blaming_the_call():
        return begun.replace(**changes)
