"""Objects that are stored as fields: settings, stages of glare and point-spread functions."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from vkbloom._settings.fields import CoreNumbers, check_fields, fields_of
from vkbloom._spelling import describe_missing_fields, did_you_mean


class _ConstructorSignature:
    """The signature of a class's ``__init__``."""

    def __get__(self, _: object, owner: type[Any]) -> inspect.Signature:
        signature = inspect.signature(owner.__init__)
        return signature.replace(parameters=[*signature.parameters.values()][1:])


def _unknown(kind: type[Record], name: str, unknown: list[str]) -> str:
    """Return the text of an error for fields that a class lacks."""
    others = {other: fields_of(other_kind) for other, other_kind in kind._classes().items()}
    return describe_missing_fields(name, unknown, fields_of(kind), others)


class Record:
    """Base class of settings, stages of glare and point-spread functions.

    A record can be stored as the name of its class and its fields, as a mapping or as JSON text.
    """

    #: The key of the class's name among the fields: "method", "stage" or "psf".
    _class_key: ClassVar[str]
    #: The beginning of error messages about the fields.
    _subject: ClassVar[str]
    #: What to use instead of an abstract class.
    _example: ClassVar[str]
    #: The core's numbers that the fields may be; None: it has none of this class.
    _core_numbers: ClassVar[CoreNumbers | None] = None

    #: The constructor's, since `inspect` would show the arguments of `__new__`.
    __signature__ = _ConstructorSignature()

    def __new__(cls, *args: Any, **values: Any) -> Self:
        """Raise TypeError for a field that the class lacks, with the field that was meant."""
        if values and dataclasses.is_dataclass(cls):
            known = fields_of(cls)
            if not known.keys() >= values.keys():
                unknown = [name for name in values if name not in known]
                raise TypeError(_unknown(cls, cls.__name__, unknown))
        return super().__new__(cls)

    def __post_init__(self) -> None:
        if self._class_name() is None:
            raise TypeError(f"{type(self).__name__} is abstract; use {self._example}")
        check_fields(self)

    @classmethod
    def _class_name(cls) -> str | None:
        """Return the name of the class in stored records; None for an abstract class."""
        name: str | None = getattr(cls, cls._class_key, None)
        return name

    @classmethod
    def _classes(cls) -> Mapping[str, type[Any]]:
        """Return the classes of stored records by name."""
        raise NotImplementedError

    @classmethod
    def _check_stored(cls, values: dict[str, Any]) -> None:
        """Take from the stored values what is no field, and check it."""

    def to_dict(self) -> dict[str, Any]:
        """Return the name of the class, and the fields by name.

        Returns
        -------
        dict
            Values that JSON can represent. The name of the class has the key "method" for settings,
            "stage" for stages of glare and "psf" for point-spread functions.
        """
        values = {name: plain_value(getattr(self, name)) for name in fields_of(type(self))}
        return {self._class_key: self._class_name(), **values}

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
        """
        if not isinstance(fields, Mapping):
            raise TypeError(f"{cls._subject}: a mapping is needed, not {type(fields).__name__}")
        key, classes, own_name = cls._class_key, cls._classes(), cls._class_name()
        name = fields.get(key, own_name)
        if not isinstance(name, str) or name not in classes:
            load = "; load its file with vkbloom.load_method" if "sha256" in fields else ""
            near = did_you_mean(name, classes)
            raise ValueError(f"{key}: {name!r} is not one of {', '.join(classes)}{load or near}")
        if own_name not in (None, name):
            raise ValueError(f"{key}: {name!r} is not the {own_name!r} of {cls.__name__}")
        values = {field: value for field, value in fields.items() if field != key}
        classes[name]._check_stored(values)
        declared = fields_of(classes[name])
        unknown = [field for field in values if field not in declared]
        if unknown:
            raise ValueError(f"{cls._subject}: {_unknown(classes[name], name, unknown)}")
        lacking = [
            field
            for field, info in declared.items()
            if field not in values and info.default is dataclasses.MISSING
        ]
        if lacking:
            raise ValueError(f"{cls._subject}: {name} needs a value for {', '.join(lacking)}")
        made: Self = classes[name](**values)
        return made

    def to_json(self) -> str:
        """Return `to_dict` as JSON text."""
        import json  # noqa: PLC0415  costs start-up time

        return json.dumps(self.to_dict())

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Make an object from the result of `to_json`."""
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
