"""Fields of settings, stages and point-spread functions: how classes declare them.

A `FieldInfo` is the one description of a field. Checks, JSON, the command line, the explorer, the
axes of grids and fits read it. It comes from the field's declaration in its class: the annotation,
the declared values, and the text about the parameter in the class's docstring. The core declares
defaults and ranges of numbers (``shaders/params.h``), which a class can replace.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, Literal, TypedDict, Unpack

from vkbloom import _core
from vkbloom._formats import MAX_FLOAT, MAX_HALF
from vkbloom._locks import ProcessLock
from vkbloom._numbers import (
    check_above,
    check_floats,
    check_integer,
    check_number,
    check_size,
)
from vkbloom._spelling import did_you_mean

Kind = Literal[
    "flag",
    "integer",
    "number",
    "choice",
    "size",
    "numbers",
    "vector",
    "pairs",
    "glare",
    "psf",
    "object",
]
#: A range of numbers; one that ends at infinity does not contain its beginning.
Range = tuple[float, float]
#: A table of the core: default, least and largest value by name.
CoreNumbers = Mapping[str, tuple[float, float, float]]

_DESCRIBING: Final = ProcessLock()

_KINDS: Final[Mapping[object, Kind]] = {
    bool: "flag",
    int: "integer",
    float: "number",
    tuple[int, int]: "size",
    tuple[float, ...]: "numbers",
    tuple[float, float, float]: "vector",
    tuple[tuple[float, float], ...]: "pairs",
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class FieldInfo:
    """The description of a field.

    - `range`: Least and largest value of a number; an infinite one stands for finite numbers
      above the least.
    - `slider`: The ends of a slider; an empty tuple for no slider; None: those of the range.
    - `unit`: "1" for numbers without a unit, "" for others.
    - `fixed`: Why the method takes only the default; "" for other fields.
    - `narrowed`: Whether the class has fewer choices than the annotation.
    - `count`: The least and the largest number of entries of a tuple; `limits`: those of its
      numbers; `columns`: how many numbers each entry has, if it is a tuple, too.
    - `read`: Checks a value of another kind and returns the value to store.
    - `text`: The help of a class without a docstring.
    - `everyday`: The place of a field of everyday use on a page: before the method's numbers below
      0, after them above 0. 0: the field is rarely changed. None: a number of everyday use if its
      slider has more than two places.
    - `differentiable`: Whether a real number has a derivative. One that decides sizes, counts of
      levels or the samples of a kernel has none.
    """

    name: str
    kind: Kind
    default: Any
    owner: type
    optional: bool = False
    choices: tuple[Any, ...] = ()
    range: Range | None = None
    slider: Range | tuple[()] | None = None
    unit: str = ""
    option: str = ""
    fixed: str = ""
    narrowed: bool = False
    count: tuple[int, int] | None = None
    limits: Range = (0.0, MAX_FLOAT)
    columns: int = 0
    read: Callable[[Any], Any] | None = None
    text: str = ""
    everyday: int | None = None
    differentiable: bool = True

    @property
    def help(self) -> str:
        """The first sentence about the parameter in the docstring of the class, or of a base."""
        from vkbloom._views.descriptions import parameter_descriptions  # noqa: PLC0415  rarely needed

        texts = (
            parameter_descriptions(kind.__doc__ or "").get(self.name) for kind in self.owner.__mro__
        )
        return self.text or next(filter(None, texts), "")

    @property
    def ends(self) -> Range | None:
        """The ends of the field's slider; None for fields without a slider."""
        if self.kind not in ("number", "integer") or self.fixed or self.slider == ():
            return None
        return self.slider or (self.range if self.is_bounded else None)

    @property
    def is_bounded(self) -> bool:
        """Whether the field is a number with a least and a largest value."""
        return self.range is not None and math.isfinite(self.range[1])

    def check(self, value: Any) -> Any:
        """Return the value to store, or raise TypeError or ValueError."""
        if value is None and self.optional:
            return None
        checked = value
        if self.read is not None:
            try:
                checked = self.read(value)
            except (TypeError, ValueError) as error:
                if self.name in str(error):
                    raise
                raise type(error)(f"{self.name}: {error}") from error
        elif self.kind == "choice":
            checked = self._choice(value)
        elif self.kind == "size":
            checked = check_size(self.name, value)
        elif self.range is not None:
            checked = self._number(value, self.range)
        elif self.count is not None:
            checked = self._numbers(value, self.count)
        if self.fixed and checked != self.default:
            only = f"{self.default:g}" if isinstance(self.default, float) else self.default
            raise ValueError(f"{self.name}: {value!r} is not {only}; {self.fixed}")
        return checked

    def _number(self, value: Any, ends: Range) -> float:
        """Return a Python number, since NumPy scalars print differently."""
        if self.kind != "number":
            integer = check_integer(self.name, value, *ends)
            return bool(integer) if self.kind == "flag" else integer
        if not self.is_bounded:
            return check_above(self.name, value, ends[0])
        return check_number(self.name, value, *ends)

    def _numbers(self, value: Any, count: tuple[int, int]) -> tuple[Any, ...]:
        numbers: tuple[Any, ...]
        if self.columns == 0:
            numbers = _row(self.name, value, self.limits)
        # An array without dimensions has the method that iterates, too.
        elif isinstance(value, Iterable) and getattr(value, "ndim", 1) > 0:
            numbers = tuple(_row(self.name, row, self.limits, self.columns) for row in value)
        else:
            raise TypeError(f"{self.name}: {value!r} is not a sequence")
        least, most = count
        if not least <= len(numbers) <= most:
            wanted = f"{least}" if least == most else f"{least} to {most}"
            raise ValueError(f"{self.name}: the number of entries, {len(numbers)}, is not {wanted}")
        return numbers

    def _choice(self, value: Any) -> Any:
        """Return a plain str, also for a subclass of str, such as an enum."""
        # An array compares with a name element by element.
        if not isinstance(value, str) or value not in self.choices:
            of = ""
            # (Masks of apertures are of no kind.)
            if self.narrowed and (key := getattr(self.owner, "_class_key", "")):
                of = f", which the {key} {getattr(self.owner, key, None)} has"
            near = did_you_mean(value, self.choices) if isinstance(value, str) else ""
            raise ValueError(
                f"{self.name}: {value!r} is not one of {', '.join(self.choices)}{of}{near}"
            )
        # Not with str(), which returns an enum's own name.
        return self.choices[self.choices.index(value)]


class Declared(TypedDict, total=False):
    """What a class can declare of any field: attributes of its `FieldInfo`."""

    kind: Kind
    optional: bool
    range: Range
    slider: Range | tuple[()] | None
    unit: str
    option: str
    fixed: str
    read: Callable[[Any], Any]
    text: str
    everyday: int
    differentiable: bool


class _Declaration:
    """A field whose class has not named it yet. Then it becomes a field of `dataclasses`.

    - `complete`: Returns the default by class and name, and can add to what is declared.
    """

    def __init__(
        self, complete: Callable[[type, str, dict[str, Any]], Any], declared: Declared
    ) -> None:
        self._complete, self._declared = complete, dict(declared)

    def __set_name__(self, owner: type, name: str) -> None:
        """Replace the declaration.

        Python 3.11 raises a RuntimeError for an error, which is then its cause.
        """
        known = Declared.__annotations__
        for word in self._declared:
            if word not in known:
                near = did_you_mean(word, known) or f"; these are {', '.join(known)}"
                raise TypeError(f"{owner.__name__}.{name}: {word!r} is not a keyword{near}")
        default = self._complete(owner, name, self._declared)
        setattr(owner, name, dataclasses.field(default=default, metadata=self._declared))


def _of_core(table: Mapping[str, Any], name: str, owner: type, field: str, instead: str) -> Any:
    """Return the row of the core's table that a class's field takes its default from."""
    if name not in table:
        raise TypeError(
            f"{owner.__name__}.{field}: the core has no {name!r}; build the core, or give {instead}"
        )
    return table[name]


def number_field(
    *, default: Any = dataclasses.MISSING, core: str = "", **declared: Unpack[Declared]
) -> Any:
    """Declare a field that is a number.

    In settings and stages, the core's number of this name has the default and the range that the
    class does not declare.

    - `core`: The core's name, where it differs.
    """

    def complete(owner: type, name: str, given: dict[str, Any]) -> Any:
        table = getattr(owner, "_core_numbers", None)
        is_complete = default is not dataclasses.MISSING and "range" in given
        if table is None or (is_complete and not core):
            return default
        instead = "core= with its name there, or default= and range="
        initial, low, high = _of_core(table, core or name, owner, name, instead)
        # A class that declares no range keeps the range of its base.
        given["table_range"] = low, high
        return initial if default is dataclasses.MISSING else default

    return _Declaration(complete, declared)


def flag_field(**declared: Unpack[Declared]) -> Any:
    """Declare a bool field, which is 0 or 1 in the core's table."""

    def complete(owner: type, name: str, _: dict[str, Any]) -> bool:
        return bool(_of_core(_core.VALUES, name, owner, name, "value_field() and a default")[0])

    return _Declaration(complete, declared)


def choice_field(choices: tuple[Any, ...] = (), **declared: Unpack[Declared]) -> Any:
    """Declare a field whose value is one of the core's names, or of some; the first is default."""

    def complete(owner: type, name: str, given: dict[str, Any]) -> Any:
        if choices:
            given["choices"] = choices
        return (choices or _of_core(_core.CHOICES, name, owner, name, "the choices"))[0]

    return _Declaration(complete, declared)


def value_field(default: Any = dataclasses.MISSING, **declared: Unpack[Declared]) -> Any:
    """Declare a field of any type; `kind` and `read` are values of a `FieldInfo`."""
    return _Declaration(lambda owner, name, given: default, declared)


def numbers_field(
    default: tuple[Any, ...] | None,
    low: float = 0.0,
    high: float = MAX_HALF,
    *,
    count: tuple[int, int] | None = None,
    **declared: Unpack[Declared],
) -> Any:
    """Declare a field of numbers, or of rows of them; `count`: None: as many as by default."""

    def complete(owner: type, name: str, given: dict[str, Any]) -> Any:
        if default and isinstance(default[0], tuple):
            given["columns"] = len(default[0])
        given |= {"count": count or (len(default or ()),) * 2, "limits": (low, high)}
        return default

    return _Declaration(complete, declared)


def _row(name: str, values: Any, limits: Range, count: int = 0) -> tuple[float, ...]:
    """Return numbers in a range; with a count so many."""
    numbers = check_floats(name, values)
    if count and len(numbers) != count:
        raise ValueError(f"{name}: {numbers!r} is not {count} numbers")
    for number in numbers:
        check_number(name, number, *limits)
    return numbers


def fields_of(kind: type[Any]) -> Mapping[str, FieldInfo]:
    """Return the descriptions of a dataclass's fields, by name."""
    infos: Mapping[str, FieldInfo] | None = kind.__dict__.get("__field_infos__")
    if infos is None:
        # `get_annotations` copies the attributes of the class, to which another thread would add.
        with _DESCRIBING:
            infos = kind.__dict__.get("__field_infos__")
            if infos is None:
                infos = kind.__field_infos__ = _fields_of(kind)
    return infos


def _fields_of(kind: type[Any]) -> Mapping[str, FieldInfo]:
    inherited: dict[str, FieldInfo] = {}
    for base in reversed(kind.__bases__):
        if dataclasses.is_dataclass(base):
            inherited.update(fields_of(base))
    # Without the annotations of bases, which are in `inherited`.
    annotations = inspect.get_annotations(kind, eval_str=True)
    return types.MappingProxyType(
        {
            field.name: _describe(kind, field, annotations[field.name], inherited.get(field.name))
            if field.name in annotations
            else dataclasses.replace(inherited[field.name], owner=kind)
            for field in dataclasses.fields(kind)
        }
    )


def _describe(
    owner: type, field: dataclasses.Field[Any], annotation: Any, base: FieldInfo | None
) -> FieldInfo:
    """Return the description of a field that a class declares; `base` is that of its base class."""
    declared = dict(field.metadata)
    table = declared.pop("table_range", None)
    if base is None and table is not None:
        declared.setdefault("range", table)
    parts = typing.get_args(annotation)
    optional = types.NoneType in parts
    if optional and len(parts) == 2:
        (annotation,) = (part for part in parts if part is not types.NoneType)
    kind = _KINDS.get(annotation, "object")
    if typing.get_origin(annotation) is Literal:
        kind = "choice"
        declared["narrowed"] = "choices" in declared or (base is not None and base.narrowed)
        declared.setdefault("choices", base.choices if base else typing.get_args(annotation))
    described = {"kind": kind, "default": field.default, "owner": owner, "optional": optional}
    if base is not None:
        if "range" in declared:
            declared.setdefault("slider", None)
        return dataclasses.replace(base, **{**described, "kind": base.kind, **declared})
    if kind == "flag":
        declared["range"] = 0, 1
    if kind in ("number", "integer"):
        declared.setdefault("unit", "1")
    return FieldInfo(**{"name": field.name, "option": field.name, **described, **declared})


def check_fields(record: Any, names: Iterable[str] | None = None) -> None:
    """Check fields of a frozen dataclass, and store the values that `FieldInfo.check` returns.

    `names`: Default: all. A default value is not checked: most are one.
    """
    known = fields_of(type(record))
    for name in known if names is None else names:
        info, value = known[name], getattr(record, name)
        if value is not info.default:
            object.__setattr__(record, name, info.check(value))
