"""The varied fields of settings as coordinates from 0 to 1."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._numbers import check_number
from vkbloom._settings.fields import FieldInfo, fields_of
from vkbloom._settings.settings import Settings, field_info
from vkbloom._spelling import did_you_mean

#: Coordinates, 0 to 1, one for each axis.
Point = NDArray[np.float64]

#: Bounds by field: (low, high) of a number, the values of a choice.
Bounds = Mapping[str, Sequence[Any]]
AxisKind = Literal["number", "integer", "choice"]

# A range this many times as wide as its scale is searched on a logarithmic scale.
_WIDE: Final = 4.0
# Numbers from one end to the other that is larger by this factor count by their size.
_DECADE: Final = 10.0
# A range without an end has the start this many times over and under.
_AROUND: Final = 4.0


@dataclass(frozen=True, kw_only=True)
class VariedField:
    """One varied field.

    - `low`, `high`: Of a number.
    - `scale`: A number x is at log(1 + (x - low) / scale), so that steps are relative to x above
      the scale; None: at x.
    - `choices`: Of a choice or a flag.
    - `ends_with_picture`: Whether values above `high` have the effect of `high`: a threshold above
      the brightest value.
    """

    name: str
    kind: AxisKind
    low: float = 0.0
    high: float = 1.0
    scale: float | None = None
    choices: tuple[Any, ...] = ()
    ends_with_picture: bool = False

    @property
    def is_relative(self) -> bool:
        """Whether changes of the number count by its size, as those of a factor."""
        is_wide = self.scale is not None or self.high > _DECADE * self.low > 0
        return self.kind == "number" and self.low >= 0 and is_wide

    def value(self, coordinate: float) -> Any:
        """Return the field's value at a coordinate."""
        if self.kind == "choice":
            return self.choices[min(int(coordinate * len(self.choices)), len(self.choices) - 1)]
        number = self.low + self._unwarp(min(max(coordinate, 0.0), 1.0) * self._length)
        number = min(max(number, self.low), self.high)
        return round(number) if self.kind == "integer" else number

    def slope(self, coordinate: float) -> float:
        """Return the derivative of a number's value by its coordinate."""
        position = min(max(coordinate, 0.0), 1.0) * self._length
        return self._length * (1.0 if self.scale is None else self.scale * math.exp(position))

    def coordinate(self, value: Any) -> float:
        """Return the coordinate of a value, the nearest where it is out of bounds."""
        if self.kind == "choice":
            return (self.choices.index(value) + 0.5) / len(self.choices)
        if self._length == 0:
            return 0.0
        number = min(max(float(value), self.low), self.high)
        return self._warp(number - self.low) / self._length

    @property
    def _length(self) -> float:
        return self._warp(self.high - self.low)

    def _warp(self, distance: float) -> float:
        return distance if self.scale is None else math.log1p(distance / self.scale)

    def _unwarp(self, position: float) -> float:
        return position if self.scale is None else self.scale * math.expm1(position)


@dataclass(frozen=True, kw_only=True)
class Space:
    """The varied fields of one candidate.

    `start`: Its other fields stay as they are.
    """

    start: Settings
    axes: tuple[VariedField, ...]

    @property
    def origin(self) -> Point:
        """The coordinates of the start."""
        return np.array(
            [axis.coordinate(_start_value(self.start, axis.name)) for axis in self.axes]
        )

    @property
    def is_number(self) -> NDArray[np.bool_]:
        """Which axes are continuous."""
        return np.array([axis.kind == "number" for axis in self.axes], np.bool_)

    def settings(self, point: Point) -> Settings:
        """Return the settings at some coordinates."""
        values = {
            axis.name: axis.value(float(position))
            for axis, position in zip(self.axes, point, strict=True)
        }
        return self.start.replace(**values)


def spaces_of_all(
    candidates: Sequence[Settings],
    names: Sequence[str],
    bounds: Bounds,
    brightest: float,
    height: int,
) -> list[Space]:
    """Return the space of each candidate that has some of the varied fields."""
    spaces, refused = [], None
    for item in candidates:
        axes: list[VariedField] = []
        for name in names:
            try:
                axes += space_of(item, [name], bounds, brightest, height).axes
            except ValueError as error:
                refused = error
        if axes:
            spaces.append(Space(start=item, axes=tuple(axes)))
    if not spaces and refused is not None:
        raise refused
    return spaces


def space_of(
    settings: Settings, vary: Sequence[str], bounds: Bounds, brightest: float, height: int
) -> Space:
    """Return the space of the varied fields of some settings."""
    fields = fields_of(type(settings))
    axes = []
    for name in vary:
        if "." not in name and name not in fields:
            known = ", ".join(item for item in fields if variation_of(fields[item]))
            raise ValueError(
                f"vary: the method {settings.method} has no field {name!r}"
                f"{did_you_mean(name, fields) or ';'} it can vary {known}"
            )
        info = _info_of(settings, name)
        kind = variation_of(info)
        if kind is None:
            raise ValueError(
                f"vary: {name!r} is not a number, a flag or a choice; fit weights by "
                "vkbloom.fit_pyramid"
            )
        if kind == "choice":
            axes.append(_choice(settings, info, bounds))
        else:
            axes.append(_number(settings, info, kind, bounds, (brightest, height)))
    space = Space(start=settings, axes=tuple(axes))
    try:
        for end in (0.0, 1.0):
            for index in range(len(axes)):
                point = space.origin
                point[index] = end
                space.settings(point)
    except ValueError as error:
        raise ValueError(f"vary: {error}") from None
    return space


def _start_value(settings: Settings, name: str) -> Any:
    """Return the value that the search starts from: no threshold is one of 0."""
    value = settings.value_of(name)
    return 0.0 if value is None and name == "threshold" else value


def _info_of(settings: Settings, name: str) -> FieldInfo:
    """Return the description of a field by its whole name, or raise ValueError."""
    try:
        return dataclasses.replace(field_info(settings, name), name=name)
    except ValueError as error:
        raise ValueError(f"vary: {error}") from None


def variation_of(info: FieldInfo) -> AxisKind | None:
    """Return how a field varies; None if it cannot."""
    match info.kind:
        case "flag":
            return "choice"
        case "choice":
            return None if info.optional else "choice"
        case "number" | "integer":
            return info.kind if info.ends is not None or info.is_bounded else None
        case _:
            return None


def _choice(settings: Settings, info: FieldInfo, bounds: Bounds) -> VariedField:
    name = info.name
    declared = info.choices or (False, True)
    choices = tuple(bounds.get(name, declared))
    if unknown := [choice for choice in choices if choice not in declared]:
        raise ValueError(
            f"bounds: {name}: {unknown[0]!r} is not one of {', '.join(map(str, declared))}"
        )
    if settings.value_of(name) not in choices:
        choices = (settings.value_of(name), *choices)
    return VariedField(name=name, kind="choice", choices=choices)


def _usual_range(info: FieldInfo, start: Any) -> tuple[float, float]:
    """Return the range of a number without a largest value: its slider's, and around the start."""
    low, high = info.ends or (0.0, 1.0)
    if start is None:
        return low, high
    return min(low, start / _AROUND), max(high, start * _AROUND)


def _number(
    settings: Settings,
    info: FieldInfo,
    kind: Literal["number", "integer"],
    bounds: Bounds,
    limits: tuple[float, int],
) -> VariedField:
    name = info.name
    low, high = info.range or (0.0, 1.0)
    ends_with_picture = False
    if name in bounds:
        given = bounds[name]
        if isinstance(given, str) or len(given) != 2:
            raise TypeError(f"bounds: {name}: {given!r} is not a pair (low, high)")
        low, high = (check_number(f"bounds: {name}", end, low, high) for end in given)
        if not low < high:
            raise ValueError(f"bounds: {name}: {low:g} is not less than {high:g}")
    elif not info.is_bounded:
        low, high = _usual_range(info, _start_value(settings, name))
    elif name == "threshold":
        brightest = max(limits[0], 1e-3)
        high, ends_with_picture = min(high, brightest), brightest < high
    elif info.unit == "pixel":
        high = min(high, max(limits[1], low + 1))
    value = _start_value(settings, name)
    if value is None:
        raise ValueError(f"vary: {name}: None is not a number; set a number to start from")
    default = info.default if isinstance(info.default, int | float) else 0.0
    usual = max(abs(float(default)), abs(float(value))) or 1.0
    is_wide = low >= 0 and high - low > _WIDE * usual
    return VariedField(
        name=name,
        kind=kind,
        low=low,
        high=high,
        scale=usual if is_wide else None,
        ends_with_picture=ends_with_picture,
    )
