"""The axes of a grid: a settings field, time or images, with their values and attributes."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import check_time
from vkbloom.settings import Settings
from vkbloom.views.descriptions import described_parameters

__all__ = ["Axis", "image_axis", "read_axes", "unit_and_description"]

Kind = Literal["settings", "time", "image"]

_TIME_DESCRIPTION = "Time of the animation; its period is 1"


@dataclass(frozen=True)
class Axis:
    """One axis of a grid.

    Parameters
    ----------
    name : str
        A settings field, "time" or "image".
    values : tuple
        The values as the settings store them; floats for "time", labels for "image".
    kind : {"settings", "time", "image"}
    unit : str
        "1" for a number without a unit.
    description : str
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
        return {name: text for name, text in described.items() if text}

    @property
    def coordinate(self) -> NDArray[Any]:
        """The values as an array of numbers, bools or text.

        None is NaN among numbers and "none" among text; tuples (sizes, weights, layers) are JSON
        text, such as "[256, 256]".
        """
        present = [value for value in self.values if value is not None]
        if present and all(isinstance(value, bool) for value in self.values):
            return np.array(self.values, np.bool_)
        if present and all(isinstance(value, int | float) for value in present):
            return np.array([math.nan if v is None else v for v in self.values])
        return np.array([_text(value) for value in self.values])

    def find(self, value: Any) -> int:
        """Return the index of a value on the axis.

        Raises
        ------
        ValueError
            The axis does not have the value.
        """
        known = tuple(value) if isinstance(value, list) else value
        if known not in self.values:
            held = ", ".join(map(_text, self.values[:8])) + ", ..." * (len(self.values) > 8)
            raise ValueError(f"{self.name}: {value!r} is not a value of the axis; it has {held}")
        return self.values.index(known)

    def label(self, place: int) -> str:
        """Return a value as a short text."""
        value = self.values[place]
        return f"{value:.4g}" if isinstance(value, float) else _text(value)


def _text(value: Any) -> str:
    if value is None:
        return "none"
    return value if isinstance(value, str) else json.dumps(value)


def unit_and_description(settings: Settings, name: str) -> tuple[str, str]:
    """Return the unit of a settings field and the first sentence of its documentation."""
    (field,) = (field for field in dataclasses.fields(settings) if field.name == name)
    texts: dict[str, str] = {}
    for kind in reversed(type(settings).__mro__):
        texts.update({key: text for key, text in described_parameters(kind).items() if text})
    is_number = field.metadata or isinstance(getattr(settings, name), float)
    return field.metadata.get("unit", "1") if is_number else "", texts.get(name, "")


def _sequence(name: str, values: object) -> list[Any]:
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise TypeError(f"axes: {name}: {values!r} is not a sequence of values")
    listed = list(values)
    if not listed:
        raise ValueError(f"axes: {name} has no values; give at least one")
    return listed


def read_axes(settings: Settings, axes: Mapping[str, Any], *, has_time: bool) -> tuple[Axis, ...]:
    """Check the requested axes.

    Parameters
    ----------
    settings : Settings
        The settings that the axes vary.
    axes : mapping of str to sequence
        Values by settings field or "time".
    has_time : bool
        Whether the source is animated.

    Returns
    -------
    tuple of Axis
        In the mapping's order.

    Raises
    ------
    TypeError, ValueError
        A name is not a field of these settings, or a value is out of the field's range.
    """
    if not isinstance(axes, Mapping):
        raise TypeError(f"axes: {axes!r} is not a mapping of field names to values")
    fields = [field.name for field in dataclasses.fields(settings)]
    found: list[Axis] = []
    for name, values in axes.items():
        if name == "time" and has_time:
            times = tuple(check_time(value) for value in _sequence(name, values))
            found.append(Axis(name, times, "time", "turn", _TIME_DESCRIPTION))
            continue
        if name not in fields:
            raise ValueError(
                f"axes: {name!r} is not a field of the method {settings.method}"
                f"{' or time' if has_time else ''}: {', '.join(fields)}"
            )
        # `replace` checks each value and converts it to the type that the settings store.
        own = tuple(
            getattr(settings.replace(**{name: value}), name) for value in _sequence(name, values)
        )
        found.append(Axis(name, own, "settings", *unit_and_description(settings, name)))
    return tuple(found)


def image_axis(labels: tuple[Any, ...]) -> Axis:
    """Return the axis of a list of images."""
    return Axis("image", labels, "image", "", "The image that bloom is added to")
