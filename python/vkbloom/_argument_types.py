"""Check the arguments of public functions against the annotations of their signatures."""

from __future__ import annotations

import functools
import inspect
import operator
import os
import re
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from typing import Any, ParamSpec, TypeVar

import numpy as np

from vkbloom._checks import as_float

__all__ = ["HINTS", "checked"]

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")
_Test = Callable[[Any], bool]

# Unions are split at bars outside of brackets.
_BAR = re.compile(r"\s*\|\s*(?![^\[]*\])")


def _raises_nothing(convert: Callable[[Any], Any]) -> _Test:
    """Return a test that holds for what `convert` takes."""

    def test(value: Any) -> bool:
        try:
            convert(value)
        except (TypeError, ValueError, OverflowError, DeprecationWarning):
            # (NumPy deprecates some names of dtypes, which is an error where warnings are.)
            return False
        return True

    return test


def _is_number(value: Any) -> bool:
    try:
        as_float("", value)
    except TypeError:
        return False
    return True


def _is_text_path(value: Any) -> bool:
    return isinstance(value, os.PathLike) and isinstance(os.fspath(value), str)


def _is_sequence(value: Any) -> bool:
    return isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping | Set)


def _is_str(value: Any) -> bool:
    return isinstance(value, str)


#: A part of an annotation, what messages call it, and its test.
_KINDS: dict[str, tuple[str, _Test]] = {
    "None": ("None", lambda value: value is None),
    "bool": ("a bool", lambda value: isinstance(value, bool | np.bool_)),
    "int": (
        "an integer",
        lambda value: not isinstance(value, bool) and _raises_nothing(operator.index)(value),
    ),
    "float": ("a number", _is_number),
    "str": ("a str", _is_str),
    "os.PathLike": ("a path", _is_text_path),
    "Path": ("a path", _is_text_path),
    "Sequence": ("a sequence", _is_sequence),
    "tuple": ("a sequence", _is_sequence),
    "Mapping": ("a mapping", lambda value: isinstance(value, Mapping)),
    "Bounds": ("a mapping", lambda value: isinstance(value, Mapping) and all(map(_is_str, value))),
    "Callable": ("callable", callable),
    "Bloom": ("callable", callable),
    "MovingBloom": ("callable", callable),
    "Twin": ("callable", callable),
    "Loss": ("a loss", lambda value: _is_str(value) or callable(value)),
    "DTypeLike": ("a dtype", _raises_nothing(np.dtype)),
    "type": ("a class", lambda value: isinstance(value, type)),
    **dict.fromkeys(
        ("Literal", "Destination", "Colour", "SavedColour", "FileEncoding", "PyramidLoss"),
        ("a str", _is_str),
    ),
}
#: What to give instead of a value, by what messages call its type. The type's module adds it.
HINTS: dict[str, Callable[[object], str]] = {}
#: Classes, found by name so that this module imports none of them.
_CLASSES = ("Renderer", "Settings", "Probe", "Camera", "PSF", "Dataset", "Tolerances")
# The type of the items of a sequence, or of the keys of a mapping.
_ITEM = re.compile(r"(?:Sequence|tuple|Mapping)\[(\w+)")


def _is_a(name: str) -> _Test:
    return lambda value: any(base.__name__ == name for base in type(value).__mro__)


def _test_of_items(part: str, test: _Test) -> _Test:
    """Return a test of a container and of its items; iterators are not consumed."""
    found = _ITEM.match(part)
    if found is None or found[1] not in _KINDS:
        return test
    item = _KINDS[found[1]][1]
    length = part.count(",") + 1 if part.startswith("tuple[") and "..." not in part else None

    def test_items(value: Any) -> bool:
        if not test(value):
            return False
        if not isinstance(value, Sequence | Mapping | np.ndarray):
            return True
        return all(map(item, value)) and (length is None or len(value) == length)

    return test_items


def _kinds(annotation: str) -> list[tuple[str, _Test]]:
    """Return what messages call an annotation's parts, with their tests; [] accepts anything."""
    kinds = []
    for part in _BAR.split(annotation.strip("\"'")):
        name = part.partition("[")[0]
        if (known := _KINDS.get(name)) is not None:
            shown = f"{known[0]}, {part}" if _ITEM.match(part) else known[0]
            kinds.append((shown, _test_of_items(part, known[1])))
        elif (last := name.rpartition(".")[2]) in _CLASSES:
            kinds.append((f"a {last}", _is_a(last)))
        else:
            return []
    return kinds


def _message(name: str, value: object, shown: list[str]) -> str:
    what = " or ".join(dict.fromkeys(one for one in shown if one != "None"))
    for kind in HINTS.keys() & {*shown}:
        return f"{name}: {reprlib.repr(value)} is not {kind}{HINTS[kind](value)}"
    return f"{name}: {reprlib.repr(value)} is not {what}"


def checked(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
    """Make a function raise TypeError for an argument of another type than its annotation names.

    The message names the parameter, the value and what is accepted. Annotations of arrays and
    of other types are left to the function.
    """
    parameters = inspect.signature(function).parameters
    kinds = {name: _kinds(str(one.annotation)) for name, one in parameters.items()}
    names = tuple(parameters)

    @functools.wraps(function)
    def call(*args: _Parameters.args, **kwargs: _Parameters.kwargs) -> _Result:
        # pytest shows the call in the test, and not this function.
        __tracebackhide__ = True
        # Too many and unknown arguments are left to Python's own error.
        for name, value in (*zip(names, args, strict=False), *kwargs.items()):
            accepted = kinds.get(name)
            if accepted and not any(test(value) for _, test in accepted):
                raise TypeError(_message(name, value, [shown for shown, _ in accepted]))
        return function(*args, **kwargs)

    return call
