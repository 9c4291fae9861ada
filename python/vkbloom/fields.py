"""Fields of settings and stages, and objects that can be stored as their fields.

The core declares the numbers of fields: their defaults and ranges are in its tables.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar, Self

from vkbloom import _core

__all__ = [
    "Record",
    "choice_field",
    "field_range",
    "flag_field",
    "import_class",
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


class Record:
    """Base class of settings, stages of glare and point-spread functions.

    A record can be stored as the name of its class and its fields, as a mapping or as JSON text.
    """

    #: The key of the class's name among the fields: "method", "stage" or "psf".
    _class_key: ClassVar[str]
    #: The beginning of error messages about the fields.
    _subject: ClassVar[str]

    @classmethod
    def _class_name(cls) -> str | None:
        """Return the name of the class in stored records; None for an abstract class."""
        name: str | None = getattr(cls, cls._class_key, None)
        return name

    @classmethod
    def _classes(cls) -> Mapping[str, type[Any]]:
        """Return the classes of stored records by name."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """Return the name of the class, and the fields by name.

        Returns
        -------
        dict
            Values that JSON can represent. The name of the class has the key "method" for settings,
            "stage" for stages of glare and "psf" for point-spread functions.

        See Also
        --------
        from_dict : Makes the object from the result.
        to_json : Returns the result as text.

        Examples
        --------
        >>> vkbloom.Pyramid(levels=3).to_dict()["levels"]
        3
        >>> vkbloom.Streaks(directions=4).to_dict()["stage"]
        'streaks'
        >>> vkbloom.psf.gaussian(sigma=2).to_dict()
        {'psf': 'gaussian', 'sigma': 2.0}
        """
        itself: Any = self
        values = {each.name: getattr(self, each.name) for each in dataclasses.fields(itself)}
        return {
            self._class_key: self._class_name(),
            **{k: plain_value(v) for k, v in values.items()},
        }

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Make an object from the result of `to_dict`.

        Parameters
        ----------
        fields : mapping of str to object
            Values by field. Missing fields have their defaults. The name of the class may be
            missing in calls on that class, such as ``Separable.from_dict``.

        Returns
        -------
        Settings, Glare or PSF
            Of the named class.

        Raises
        ------
        ValueError
            There is no such class or field, the named class is not that of the call, a field
            without a default has no value, or a value is out of range.
        TypeError
            `fields` is not a mapping, or a value has the wrong type.

        See Also
        --------
        to_dict : Returns the fields by name.

        Examples
        --------
        >>> vkbloom.Streaks.from_dict({"stage": "streaks", "directions": 4}).directions
        4
        >>> vkbloom.psf.PSF.from_dict({"psf": "gaussian", "sigma": 2})
        gaussian(sigma=2.0)
        """
        if not isinstance(fields, Mapping):
            raise TypeError(f"{cls._subject}: a mapping is needed, not {type(fields).__name__}")
        key, classes, own = cls._class_key, cls._classes(), cls._class_name()
        name = fields.get(key, own)
        if not isinstance(name, str) or name not in classes:
            raise ValueError(f"{key}: {name!r} is not one of {', '.join(classes)}")
        if own not in (None, name):
            raise ValueError(f"{key}: {name!r} is not the {own!r} of {cls.__name__}")
        values = {field: value for field, value in fields.items() if field != key}
        declared = dataclasses.fields(classes[name])
        known = [field.name for field in declared]
        unknown = [field for field in values if field not in known]
        if unknown:
            raise ValueError(
                f"{cls._subject}: {name} has no {', '.join(map(repr, unknown))}; "
                f"it has {', '.join(known)}"
            )
        without = (dataclasses.MISSING, dataclasses.MISSING)
        lacking = [
            field.name
            for field in declared
            if field.name not in values and (field.default, field.default_factory) == without
        ]
        if lacking:
            raise ValueError(f"{cls._subject}: {name} needs a value for {', '.join(lacking)}")
        made: Self = classes[name](**values)
        return made

    def to_json(self) -> str:
        """Return `to_dict` as JSON text.

        See Also
        --------
        from_json : Makes the object from the result.

        Examples
        --------
        >>> vkbloom.psf.gaussian(sigma=2).to_json()
        '{"psf": "gaussian", "sigma": 2.0}'
        """
        import json  # noqa: PLC0415  costs start-up time

        return json.dumps(self.to_dict())

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Make an object from the result of `to_json`.

        Parameters
        ----------
        text : str
            An object with the keys of `from_dict`.

        Returns
        -------
        Settings, Glare or PSF

        Raises
        ------
        ValueError, TypeError
            The text is not a JSON object, or as for `from_dict`.

        See Also
        --------
        to_json : Returns the text.

        Examples
        --------
        >>> from vkbloom import Settings
        >>> Settings.from_json('{"method": "pyramid", "levels": 3}').levels
        3
        """
        import json  # noqa: PLC0415  costs start-up time

        try:
            fields = json.loads(text)
        except RecursionError:
            raise ValueError("text: lists and objects are nested too deeply") from None
        return cls.from_dict(fields)


def plain_value(value: Any) -> Any:
    """Return the value of a field as values that JSON can represent."""
    if isinstance(value, tuple | list):
        return [plain_value(item) for item in value]
    for convert in ("to_dict", "to_plain"):
        if hasattr(value, convert):
            return getattr(value, convert)()
    return value
