"""The axes of a grid: a settings field or time, with their values and attributes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._numbers import check_time
from vkbloom._settings.antialiasing import check_antialiasing
from vkbloom._settings.exposure import Exposure, check_exposure, check_seconds
from vkbloom._settings.fields import fields_of
from vkbloom._settings.records import plain_value
from vkbloom._settings.settings import (
    Settings,
    check_settings,
    field_info,
    presets,
    resolve_settings,
)
from vkbloom._spelling import did_you_mean

Kind = Literal["settings", "time", "preset", "stage"]

#: Axes whose values are settings of any methods, on which the other axes' fields are changed.
WHOLE: Final = ("preset", "settings")

_TIME_DESCRIPTION = "Time of the animation; its period is 1"


@dataclass(frozen=True)
class Axis:
    """One axis of a grid: a settings field, "time", "preset" or "settings".

    - `values`: As the settings store them; names of presets.
    - `kind`: The axis "settings" has the kind "preset": its values are settings of any methods. A
      "stage" is a keyword of a call for a stage in time.
    - `unit`: "1" for a number without a unit.
    """

    name: str
    values: tuple[Any, ...]
    kind: Kind
    unit: str
    description: str

    def __len__(self) -> int:
        return len(self.values)

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the coordinate."""
        described = {"long_name": self.name, "units": self.unit, "description": self.description}
        if self.name == "preset":
            # The settings of these names at the time of rendering.
            described["settings"] = json.dumps(
                {name: presets[name].to_dict() for name in self.values}
            )
        return {name: text for name, text in described.items() if text}

    @property
    def coordinate(self) -> NDArray[Any]:
        """The values as an array of numbers, bools or text.

        None is NaN among numbers and "none" among text. All others (sizes, weights, stages,
        point-spread functions, settings) are JSON text, such as "[256, 256]".
        """
        present = [value for value in self.values if value is not None]
        if present and all(isinstance(value, bool) for value in self.values):
            return np.array(self.values, np.bool_)
        if present and all(isinstance(value, int | float) for value in present):
            return np.array([math.nan if v is None else v for v in self.values])
        return np.array([_text(value) for value in self.values])

    def label(self, index: int) -> str:
        """Return a value as a short text."""
        value = self.values[index]
        return f"{value:.4g}" if isinstance(value, float) else _text(value)


def _text(value: Any) -> str:
    if value is None:
        return "none"
    return value if isinstance(value, str) else json.dumps(plain_value(value))


def _whole_axis(name: str, values: object) -> Axis:
    """Check an axis of presets or of settings."""
    listed = _sequence(name, values)
    if name == "preset":
        for value in listed:
            try:
                presets[value]
            except KeyError as error:
                raise ValueError(f"axes: preset: {error.args[0]}") from None
            except TypeError:
                raise TypeError(f"axes: preset: {value!r} is not a name") from None
        return Axis(name, tuple(listed), "preset", "", "The name of the settings")
    listed = [resolve_settings(value, "axes: settings") for value in listed]
    return Axis(name, tuple(listed), "preset", "", "The settings as JSON")


def _stage_axis(name: str, values: list[Any]) -> Axis | None:
    """Check an axis of exposures, anti-aliasing or steps of time; None: it is of none of them."""
    if name == "dt":
        steps = tuple(check_seconds("axes: dt", value) for value in values)
        return Axis(name, steps, "stage", "s", "Seconds since the frame before")
    if name == "taa":
        for value in values:
            check_antialiasing(value)
        return Axis(name, tuple(values), "stage", "", "Temporal anti-aliasing")
    if name != "exposure" or not any(isinstance(value, str | Exposure) for value in values):
        return None
    for value in values:
        if not isinstance(value, str | Exposure):
            raise TypeError(
                f"axes: exposure: {value!r} is not an exposure, as other values are; stops of the "
                "settings are an axis of their own grid"
            )
        check_exposure(value)
    return Axis(name, tuple(values), "stage", "", "The exposure that follows the light")


def _sequence(name: str, values: object) -> list[Any]:
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise TypeError(f"axes: {name}: {values!r} is not a sequence of values")
    listed = list(values)
    if not listed:
        raise ValueError(f"axes: {name} has no values; give at least one")
    return listed


def read_axes(
    settings: Settings | None, axes: Mapping[str, Any], *, has_time: bool
) -> tuple[Axis, ...]:
    """Check the requested axes."""
    if not isinstance(axes, Mapping):
        raise TypeError(f"axes: {axes!r} is not a mapping of field names to values")
    for name in axes:
        if not isinstance(name, str):
            raise TypeError(f"axes: {name!r} is not the name of a field")
    whole = {name: _whole_axis(name, axes[name]) for name in WHOLE if name in axes}
    if len(whole) > 1:
        raise ValueError("axes: preset and settings exclude each other; give one of them")
    if whole and settings is not None:
        raise ValueError(
            f"settings: the axis {next(iter(whole))} sets all settings; leave the argument out, "
            "and vary fields by further axes"
        )
    bases = [base for axis in whole.values() for base in settings_of(axis)] or [
        check_settings(settings, of_image=not has_time)
    ]
    read: list[Axis] = []
    for name, values in axes.items():
        if name in whole:
            read.append(whole[name])
            continue
        if (stage := _stage_axis(name, _sequence(name, values))) is not None:
            read.append(stage)
            continue
        if name == "time" and has_time:
            times = tuple(check_time(value) for value in _sequence(name, values))
            read.append(Axis(name, times, "time", "turn", _TIME_DESCRIPTION))
            continue
        for base in bases:
            fields = fields_of(type(base))
            if name not in fields and not name.startswith("glare."):
                near = did_you_mean(name, [*fields, *WHOLE, "time"])
                raise ValueError(
                    f"axes: {name!r} is not a field of the method {base.method}"
                    f"{' or time' if has_time else ''}{near or ':'} {', '.join(fields)}"
                )
        # `replace` checks each value and converts it to the type that the settings store.
        listed = _sequence(name, values)
        converted = [
            tuple(base.replace(**{name: value}).value_of(name) for value in listed)
            for base in bases
        ]
        info = field_info(bases[0], name)
        read.append(Axis(name, converted[0], "settings", info.unit, info.help))
    return tuple(read)


def settings_of(axis: Axis) -> tuple[Settings, ...]:
    """Return the settings at each value of an axis of presets or settings."""
    return tuple(presets[value] if axis.name == "preset" else value for value in axis.values)
