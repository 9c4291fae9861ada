"""The options of the settings: ``--method``, ``--preset``, and one for each field."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import click

import vkbloom
from vkbloom._cli import fields
from vkbloom._cli.image_files import is_photograph, silenced
from vkbloom._cli.program import as_wrong_use
from vkbloom._cli.sequences import as_file
from vkbloom._io.expansion import PHOTO_EXPANSION
from vkbloom._renderer.frame_files import facts_of
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS

#: The preset for images if there is no --preset and no --method.
PRESET_OF_IMAGES: Final = "bevy_natural"
#: The preset for image files of integers, where a command can expand their highlights.
PRESET_OF_PHOTOS: Final = "photo"
_PRESET_OF_SCENES: Final = "tutorial"
#: The presets that a call without --preset and --method may start from.
DEFAULT_PRESETS: Final = (PRESET_OF_IMAGES, PRESET_OF_PHOTOS, _PRESET_OF_SCENES)
#: Parameters that say what a call starts from.
STARTS: Final = ("preset", "method", "stored")


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the settings to a command; its argument `settings` has the result."""

    def run(*, start: Start, **rest: Any) -> Any:
        settings, expand = start.of(str(rest.get("source") or ""))
        if "expand" in rest:
            rest["expand"] = expand
        return command(settings=settings, **rest)

    return start_options(functools.update_wrapper(run, command))


def start_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the settings to a command; its argument `start` has them."""

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
        help="The method of the blur, with its defaults, or a file of a custom method.",
    )
    @fields.options({"": vkbloom.Settings}, "shared")
    @fields.options(METHODS, "of_method", base=vkbloom.Settings)
    @click.option(
        "--settings",
        "stored",
        metavar="FILE",
        type=click.Path(),
        help="Settings to start from: JSON, or a PNG or OpenEXR picture that vkbloom wrote.",
    )
    @functools.wraps(command)
    def run(
        *,
        preset: str | None,
        method: str | None,
        stored: str | None,
        shared: dict[str, Any],
        of_method: dict[str, Any],
        **rest: Any,
    ) -> Any:
        if stored is not None and preset is not None:
            raise click.UsageError("--settings and --preset exclude each other; leave one out")
        start = Start(
            preset=preset,
            method=method,
            stored=None if stored is None else read_settings(stored),
            changes={**shared, **of_method},
            expands="expand" in rest,
            expand=rest.get("expand"),
        )
        return command(start=start, **rest)

    return run


@dataclasses.dataclass(frozen=True, kw_only=True)
class Start:
    """What the settings of a call start from, and how its options change them.

    - `stored`: Settings of a file, and what its picture was expanded up to.
    - `expands`: Whether the highlights of files of integers can be expanded.
    - `expand`: What they are expanded up to, if the call says it.
    """

    preset: str | None
    method: str | None
    stored: tuple[vkbloom.Settings, float | None] | None
    changes: dict[str, Any]
    expands: bool
    expand: float | None

    def of(self, image: str) -> tuple[vkbloom.Settings, float | None]:
        """Return the settings for an image file, "" for a scene, and the value for --expand."""
        begun, expand = self._begun(image)
        return _changed(begun, self.changes), expand if self.expand is None else self.expand

    def _begun(self, image: str) -> tuple[vkbloom.Settings, float | None]:
        if self.stored is not None:
            begun, expand = self.stored
        elif self.preset is None and self.method is not None:
            begun, expand = METHODS[self.method](), None
        else:
            preset = self.preset or _preset_of(image, expands=self.expands)
            begun = vkbloom.presets[preset]
            expand = PHOTO_EXPANSION if preset == PRESET_OF_PHOTOS else None
        if self.method not in (None, begun.method):
            given = "--settings" if self.stored else f"--preset {self.preset}"
            raise click.UsageError(f"{given} is of the method {begun.method}, not {self.method}")
        return begun, expand


def _preset_of(image: str, *, expands: bool) -> str:
    """Return the preset that an image file, or a scene (""), starts from."""
    if not image:
        return _PRESET_OF_SCENES
    return PRESET_OF_PHOTOS if expands and is_photograph(image) else PRESET_OF_IMAGES


def read_settings(name: str) -> tuple[vkbloom.Settings, float | None]:
    """Return the settings of a file, and what the highlights of its picture were expanded up to."""
    with silenced(), as_file(name) as file:
        try:
            with open(file, "rb") as stream:
                is_json = stream.read(64).lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"{")
            if is_json or name.lower().endswith(".json"):
                text = Path(file).read_text(encoding="utf-8-sig")
                return vkbloom.Settings.from_json(text), PHOTO_EXPANSION
            facts = facts_of(file)
            if "settings" not in facts:
                raise ValueError("holds no settings; PNG and OpenEXR files of vkbloom hold them")
            expand = facts.get("expand")
            settings = vkbloom.Settings.from_json(facts["settings"])
            return settings, None if expand is None else float(expand)
        except (TypeError, ValueError) as error:
            reason = str(error)
            raise ValueError(reason if file in reason else f"{file}: {reason}") from error


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
