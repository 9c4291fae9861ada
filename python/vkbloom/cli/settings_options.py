"""The options of the settings: ``--method``, ``--preset``, and one for each field."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Final

import click

import vkbloom
from vkbloom.cli import fields
from vkbloom.cli.image_files import is_photograph
from vkbloom.cli.program import as_wrong_use
from vkbloom.fields import fields_of
from vkbloom.io.expansion import PHOTO_EXPANSION
from vkbloom.registry import METHODS

#: The preset for images if there is no --preset and no --method.
PRESET_OF_IMAGES: Final = "bevy_natural"
#: The preset for image files of integers, where a command can expand their highlights.
PRESET_OF_PHOTOS: Final = "photo"
_PRESET_OF_SCENES: Final = "tutorial"
#: The presets that a call without --preset and --method may start from.
DEFAULT_PRESETS: Final = (PRESET_OF_IMAGES, PRESET_OF_PHOTOS, _PRESET_OF_SCENES)
# Names of the commands' arguments for image files; explore and grid may be called without one.
_IMAGES: Final = ("source", "sources", "images")


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the settings to a command; its argument `settings` has the result."""

    @click.option(
        "--preset",
        type=fields.NameOf("preset", vkbloom.presets),
        help="Published settings to start from; vkbloom presets lists them "
        f"[default {PRESET_OF_IMAGES} for images, {PRESET_OF_PHOTOS} for files of integers, "
        f"{_PRESET_OF_SCENES} for scenes]",
    )
    @click.option(
        "--method",
        type=fields.NameOf("method", METHODS),
        help="The method of the blur, with its defaults, or a file of an own method "
        "[default the preset's]",
    )
    @_glare_options
    @fields.options({"": vkbloom.Settings}, "shared")
    @fields.options(METHODS, "own", base=vkbloom.Settings)
    @functools.wraps(command)
    def run(
        preset: str | None,
        method: str | None,
        added: tuple[vkbloom.Glare, ...],
        shared: dict[str, Any],
        own: dict[str, Any],
        **rest: object,
    ) -> object:
        if preset is None and method is None:
            image = _first_of(rest)
            preset = PRESET_OF_IMAGES if image else _PRESET_OF_SCENES
            if "expand" in rest and not rest.get("raw") and is_photograph(image):
                preset = PRESET_OF_PHOTOS
        if preset == PRESET_OF_PHOTOS and "expand" in rest and rest["expand"] is None:
            rest["expand"] = PHOTO_EXPANSION
        begun = _begun(preset, method)
        if added:
            shared["glare"] = (*shared.get("glare", begun.glare), *added)
        return command(settings=_changed(begun, {**shared, **own}), **rest)

    return run


def _glare_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add options for stages; the command's argument `added` has the stages."""

    @click.option("--streaks", type=click.IntRange(1, 16), help="Add this many streaks to --glare")
    @click.option("--ghosts", is_flag=True, help="Add ghosts to --glare")
    @click.option("--halo", is_flag=True, help="Add a halo to --glare")
    @click.option(
        "--dirt", type=click.Path(), help="Add dirt, with the picture of a file, to --glare"
    )
    @functools.wraps(command)
    def run(
        streaks: int | None, ghosts: bool, halo: bool, dirt: str | None, **rest: object
    ) -> object:
        added: list[vkbloom.Glare] = []
        if streaks is not None:
            added.append(vkbloom.Streaks(directions=streaks))
        if ghosts:
            added.append(vkbloom.Ghosts())
        if halo:
            added.append(vkbloom.Halo())
        if dirt is not None:
            picture = fields.read_colours(dirt)
            with as_wrong_use():
                added.append(vkbloom.Dirt(image=picture))
        return command(added=tuple(added), **rest)

    return run


def _first_of(rest: dict[str, Any]) -> str:
    """Return the first of a command's image files; "" if it has none."""
    names = next((value for name in _IMAGES if (value := rest.get(name))), "")
    return names if isinstance(names, str) else str(names[0])


def _begun(preset: str | None, method: str | None) -> vkbloom.Settings:
    """Return the settings of a preset or the defaults of a method."""
    begun = METHODS[str(method)]() if preset is None else vkbloom.presets[preset]
    if method not in (None, begun.method):
        raise click.UsageError(f"--preset {preset} is of the method {begun.method}, not {method}")
    return begun


def _changed(begun: vkbloom.Settings, changes: dict[str, Any]) -> vkbloom.Settings:
    """Return settings with the options' changes."""
    foreign = [name for name in changes if not hasattr(begun, name)]
    if foreign:
        declared = {
            name: info for kind in METHODS.values() for name, info in fields_of(kind).items()
        }
        names = ", ".join(f"--{declared[name].option.replace('_', '-')}" for name in foreign)
        having = " or ".join(
            method
            for method, kind in METHODS.items()
            if all(name in fields_of(kind) for name in foreign)
        )
        raise click.UsageError(
            f"the method {begun.method} has no {names}; "
            + (f"give --method {having}" if having else "no method has all of them")
        )
    with as_wrong_use():
        return begun.replace(**changes)
