"""Fields of settings and stages, and the objects that are made of fields by name.

The core declares the numbers of fields: their defaults and ranges are in its tables.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from vkbloom import _core

__all__ = [
    "choice_field",
    "field_range",
    "flag_field",
    "import_class",
    "make_from_fields",
    "number_field",
]


def number_field(
    name: str,
    *,
    default: float | None = None,
    unit: str = "1",
    range: tuple[float, float] | None = None,
    option: str | None = None,
    table: Mapping[str, tuple[float, float, float]] = _core.VALUES,
) -> Any:
    """Declare a field that is a number in one of the core's tables, which gives its default.

    The table also gives the range. A method whose source has a narrower range declares it here.
    `option` is the field's name on the command line, if it differs.
    """
    initial, _, _ = table[name]
    return dataclasses.field(
        default=initial if default is None else default,
        metadata={"unit": unit, "range": range, "option": option or name},
    )


def field_range(field: dataclasses.Field[Any]) -> tuple[float, float]:
    """Return the least and the largest value of a field that is a number."""
    narrowed: tuple[float, float] | None = field.metadata.get("range")
    _, low, high = _core.VALUES[field.name]
    return narrowed or (low, high)


def flag_field(name: str) -> Any:
    """Declare a bool field, which is 0 or 1 in the core's table."""
    return dataclasses.field(default=bool(_core.VALUES[name][0]))


def choice_field(name: str) -> Any:
    """Declare a field whose value is one of the core's names; the first is the default."""
    return dataclasses.field(default=_core.CHOICES[name][0])


def import_class(place: str) -> Any:
    """Return the class at a place such as "package.module:Class"."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def make_from_fields(
    cls: type[Any], kinds: Mapping[str, type[Any]], key: str, fields: object, subject: str
) -> Any:
    """Make an object of one of several classes from the values of its fields.

    Parameters
    ----------
    cls : type
        The class that is asked for: one of `kinds`, or their base class.
    kinds : mapping of str to type
        Dataclasses by name.
    key : str
        The key of the name among `fields`. It may be missing if `cls` is one of the kinds.
    fields : mapping of str to object
        Values by field. Missing fields have their defaults.
    subject : str
        Begins the error messages about fields.

    Raises
    ------
    ValueError
        There is no such class or field, the class is not `cls`, a field without a default has no
        value, or a value is out of range.
    TypeError
        `fields` is not a mapping, or a value has the wrong type.
    """
    if not isinstance(fields, Mapping):
        raise TypeError(f"{subject}: a mapping is needed, not {type(fields).__name__}")
    own = next((name for name, kind in kinds.items() if kind is cls), None)
    name = fields.get(key, own)
    if not isinstance(name, str) or name not in kinds:
        raise ValueError(f"{key}: {name!r} is not one of {', '.join(kinds)}")
    if own not in (None, name):
        raise ValueError(f"{key}: {name!r} is not the {own!r} of {cls.__name__}")
    values = {field: value for field, value in fields.items() if field != key}
    declared = dataclasses.fields(kinds[name])
    known = [field.name for field in declared]
    unknown = [field for field in values if field not in known]
    if unknown:
        raise ValueError(
            f"{subject}: {name} has no {', '.join(map(repr, unknown))}; it has {', '.join(known)}"
        )
    without = (dataclasses.MISSING, dataclasses.MISSING)
    lacking = [
        field.name
        for field in declared
        if field.name not in values and (field.default, field.default_factory) == without
    ]
    if lacking:
        raise ValueError(f"{subject}: {name} needs a value for {', '.join(lacking)}")
    return kinds[name](**values)
