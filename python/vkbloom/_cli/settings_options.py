"""The options of the settings: ``--method``, ``--preset``, and one for each field."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import click

from vkbloom._cli import fields
from vkbloom._cli.image_files import highlights_of_file, silence
from vkbloom._cli.program import as_wrong_use, is_given
from vkbloom._cli.sequences import as_file
from vkbloom._io.expansion import check_expansion
from vkbloom._io.picture import Highlights
from vkbloom._presets.start import (
    PRESET_OF_IMAGES,
    PRESET_OF_PHOTOS,
    PRESET_OF_SCENES,
    Start,
    start_of,
)
from vkbloom._renderer.default import take_exposure
from vkbloom._renderer.frame_files import facts_of
from vkbloom._settings.antialiasing import Antialiasing, antialiasing
from vkbloom._settings.exposed import read_record
from vkbloom._settings.exposure import MAX_SECONDS, Exposure
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import EXPANDED, STAGES_IN_TIME, Settings, presets

#: The presets that a call without --preset and --method may start from.
DEFAULT_PRESETS: Final = (PRESET_OF_IMAGES, PRESET_OF_PHOTOS, PRESET_OF_SCENES)
#: Parameters that say what a call starts from.
STARTS: Final = ("preset", "method", "stored")


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the settings to a command; its argument `settings` has the result."""

    def run(*, start: StartOptions, **rest: Any) -> Any:
        return command(**_settings_of(start, rest), **rest)

    return start_options(functools.update_wrapper(run, command))


def timed_settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the same, and options of stages in time; the argument `stages` has keywords of a call."""

    @click.option(
        "--dt",
        metavar="SECONDS",
        type=click.FloatRange(0, MAX_SECONDS),
        help="Time since the frame before, with an exposure [default 1/60]",
    )
    def run(*, start: StartOptions, dt: float | None, **rest: Any) -> Any:
        stages = dict(start.stages)
        if dt is not None:
            stages["dt"] = dt
        return command(**_settings_of(start, rest), stages=stages, **rest)

    return start_options(functools.update_wrapper(run, command), is_timed=True)


def _settings_of(start: StartOptions, rest: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of a call; the argument `expand` of the others gets its value."""
    settings, expand = start.of_file(str(rest.get("source") or ""))
    if "expand" in rest:
        rest["expand"] = expand
    return {"settings": settings}


def taa_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option --taa to a command with stages in time."""
    return click.option(
        "--taa",
        type=fields.TAA,
        help="Temporal anti-aliasing of an engine, which mixes each frame with those before: "
        f"{', '.join(antialiasing)}.",
    )(command)


#: What --exposure takes in commands with stages in time.
_TIMED: Final = {
    "exposure": (
        fields.EXPOSURE,
        "Or the exposure of an engine, which follows the light; vkbloom exposures lists them.",
    )
}


def start_options(command: Callable[..., Any], *, is_timed: bool = False) -> Callable[..., Any]:
    """Add the options of the settings to a command; its argument `start` has them.

    `is_timed`: The command has stages in time.
    """

    @click.option(
        "--preset",
        type=fields.NameOf("preset", presets),
        help="Published settings to start from; vkbloom presets lists them "
        f"[default {PRESET_OF_IMAGES} for images, {PRESET_OF_PHOTOS} for files of integers, "
        f"{PRESET_OF_SCENES} for scenes]",
    )
    @click.option(
        "--method",
        type=fields.NameOf("method", METHODS),
        help="The method of the blur, with its defaults, or a file of a custom method.",
    )
    @fields.options({"": Settings}, "shared", types=_TIMED if is_timed else {})
    @fields.options(METHODS, "of_method", base=Settings)
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
        exposure = take_exposure(shared.pop("exposure", None), shared)
        start = StartOptions(
            exposure=exposure,
            taa=rest.pop("taa", None),
            preset=preset,
            method=method,
            stored=None if stored is None else read_settings(stored),
            changes={**shared, **of_method},
            expand=rest.get("expand"),
            amount=rest.get("amount", 1.0),
            subimage=rest.get("subimage") or 0,
            layer=rest.get("layer"),
            colour=rest.get("input_colour"),
        )
        return command(start=start, **rest)

    return run


#: The same for a command with stages in time, whose frames it reads.
timed_start_options: Final = functools.partial(start_options, is_timed=True)


@dataclasses.dataclass(frozen=True, kw_only=True)
class StartOptions:
    """What the options of a call say of its settings, for `start_of`.

    - `stored`: What a file holds of settings.
    - `exposure`, `taa`: Stages in time.
    - `expand`: What highlights are expanded up to, if the call says it.
    - `amount`: A factor of the strength of all that it starts from.
    - `subimage`, `layer`, `colour`: How image files are read.
    """

    preset: str | None
    method: str | None
    stored: Stored | None
    changes: dict[str, Any]
    expand: float | None
    exposure: Exposure | None = None
    taa: Antialiasing | None = None
    amount: float = 1.0
    subimage: int = 0
    layer: str | None = None
    colour: str | None = None

    @property
    def is_chosen(self) -> bool:
        """Whether the call names what it starts from."""
        return self.preset is not None or self.method is not None or self.stored is not None

    @property
    def stages(self) -> Mapping[str, Any]:
        """The keywords of a call for its stages in time."""
        given = {"exposure": self.exposure, "taa": self.taa}
        stages = {name: stage for name, stage in given.items() if stage is not None}
        return stages or ({} if self.stored is None else self.stored.stages)

    def of_file(self, image: str) -> Start:
        """Return where an image file starts; "": a scene."""
        if not image:
            return self.of(None)
        return self.of(highlights_of_file(image, self.subimage, self.layer, self.colour))

    def of(self, highlights: Highlights | None) -> Start:
        """Return where an image with these highlights starts; None: a scene."""
        expand = self.expand
        if expand is None and self.stored is not None:
            expand = self.stored.expand
        begun = self._find_start() or start_of(highlights).settings
        _check_declared(begun, self.changes)
        with as_wrong_use():
            return start_of(highlights, begun, self.changes, expand=expand, amount=self.amount)

    def _find_start(self) -> Settings | None:
        """Return what the settings start from; None: the default for the source."""
        if self.stored is not None:
            begun = self.stored.settings
        elif self.preset is not None:
            begun = presets[self.preset]
        else:
            return None if self.method is None else METHODS[self.method]()
        if self.method not in (None, begun.method):
            named = "--settings" if self.stored else f"--preset {self.preset}"
            raise click.UsageError(f"{named} is of the method {begun.method}, not {self.method}")
        return begun


class Stored(NamedTuple):
    """What a file holds of settings.

    - `expand`: What the highlights of its picture were expanded up to.
    - `stages`: Keywords of a call for its stages in time.
    """

    settings: Settings
    expand: float | None
    stages: Mapping[str, Any]


def read_settings(name: str) -> Stored:
    """Return the settings of a file, and what else it holds of them."""
    with silence(), as_file(name) as file:
        try:
            with open(file, "rb") as stream:
                is_json = stream.read(64).lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"{")
            if is_json or name.lower().endswith(".json"):
                text = Path(file).read_text(encoding="utf-8-sig")
                settings = Settings.from_json(text)
                values = json.loads(text)
                expand, stages = values.get(EXPANDED), values.get(STAGES_IN_TIME)
            else:
                facts = facts_of(file)
                if "settings" not in facts:
                    raise ValueError(
                        "holds no settings; PNG and OpenEXR files of vkbloom hold them"
                    )
                settings = Settings.from_json(facts["settings"])
                expand, stages = facts.get("expand"), json.loads(facts.get("stages", "null"))
            return Stored(
                settings,
                None if expand is None else check_expansion(float(expand)),
                {} if stages is None else read_record(stages),
            )
        except (TypeError, ValueError) as error:
            reason = str(error)
            raise ValueError(reason if file in reason else f"{file}: {reason}") from error


def _check_declared(begun: Settings, changes: Mapping[str, Any]) -> None:
    """Raise click.UsageError for options that the settings' method does not have."""
    used = {name: _option_that_set(name) for name in changes}
    foreign = [name for name in changes if _option_of(type(begun), name) != used[name]]
    if not foreign:
        return
    having = " or ".join(
        method
        for method, kind in METHODS.items()
        if all(_option_of(kind, name) == used[name] for name in foreign)
    )
    others = [option for name in foreign if (option := _option_of(type(begun), name))]
    raise click.UsageError(
        f"the method {begun.method} has no {_as_words(used[name] for name in foreign)}; "
        + (f"it has {_as_words(others)}; " if others else "")
        + (f"give --method {having}" if having else "no method has all of them")
    )


def _option_that_set(name: str) -> str:
    """Return the option that set a field; fields of one name may have several."""
    options = [_option_of(kind, name) for kind in METHODS.values()]
    return next(option for option in options if option and is_given(option))


def _option_of(kind: type[Settings], name: str) -> str:
    """Return the name of the option of a method's field; "" if there is no such field."""
    info = fields_of(kind).get(name)
    return "" if info is None else info.option


def _as_words(options: Iterable[str]) -> str:
    return ", ".join(f"--{option.replace('_', '-')}" for option in options)
