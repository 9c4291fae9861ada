"""Check the arguments of public functions by their annotations."""

from __future__ import annotations

import functools
import inspect
import operator
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from types import NoneType, UnionType
from typing import Any, Final, Literal, NamedTuple, TypeVar, Union, cast, get_args, get_origin

import numpy as np

from vkbloom._numbers import as_float

_Function = TypeVar("_Function", bound=Callable[..., Any])


class _Kind(NamedTuple):
    """What messages call the values of an annotation, and many of them, and a test of one."""

    what: str
    many: str
    test: Callable[[Any], bool]


def _is_number(value: Any) -> bool:
    try:
        as_float("", value)
    except TypeError:
        return False
    return True


def _is_integer(value: Any) -> bool:
    try:
        operator.index(value)
    except TypeError:
        return False
    return not isinstance(value, bool)


def _is_path(value: Any) -> bool:
    return isinstance(value, os.PathLike) and isinstance(os.fspath(value), str)


def _is_mapping(value: Any) -> bool:
    return isinstance(value, Mapping) and all(isinstance(key, str) for key in value)


_TEXT: Final = _Kind("a str", "str", lambda value: isinstance(value, str))
_KINDS: Final[Mapping[Any, _Kind]] = {
    bool: _Kind("a bool", "bools", lambda value: isinstance(value, bool | np.bool_)),
    int: _Kind("an integer", "integers", _is_integer),
    float: _Kind("a number", "numbers", _is_number),
    str: _TEXT,
    # Which ones there are, the function says.
    Literal: _TEXT,
    os.PathLike: _Kind("a path", "paths", _is_path),
    Callable: _Kind("callable", "callables", callable),
}


def _kind_of(annotation: Any) -> _Kind | None:
    """Return the kind of an annotation; None for what the function reads by itself."""
    if get_origin(annotation) not in (Union, UnionType):
        return _builtin_kind_of(annotation) or _class(annotation)
    parts = [part for part in get_args(annotation) if part is not NoneType]
    if len(parts) == 1:
        return _kind_of(parts[0])
    kinds = [_builtin_kind_of(part) for part in parts]
    known = [kind for kind in kinds if kind is not None]
    if len(known) < len(kinds):
        return None
    what = " or ".join(dict.fromkeys(kind.what for kind in known))
    return _Kind(what, "", lambda value: any(kind.test(value) for kind in known))


def _builtin_kind_of(annotation: Any) -> _Kind | None:
    """Return the kind of a built-in type, or of a sequence or mapping of one; None for others."""
    origin, parts = get_origin(annotation) or annotation, get_args(annotation)
    if origin in (Sequence, Iterable):
        item = _scalar_kind_of(parts[0])
        return None if item is None else _sequence(item)
    if origin is Mapping and parts[0] is str:
        is_known = parts[1] is Any or _scalar_kind_of(parts[1]) is not None
        return _Kind("a mapping by str", "", _is_mapping) if is_known else None
    if annotation == tuple[int, int]:
        return _sequence(_KINDS[int], 2)._replace(what="a pair of integers")
    return _scalar_kind_of(annotation)


def _scalar_kind_of(annotation: Any) -> _Kind | None:
    return _KINDS.get(get_origin(annotation) or annotation)


def _class(annotation: Any) -> _Kind | None:
    if not isinstance(annotation, type) or annotation is Any:
        return None
    return _Kind(f"a {annotation.__name__}", "", lambda value: isinstance(value, annotation))


def _sequence(item: _Kind, length: int | None = None) -> _Kind:
    """Return the kind of sequences. Iterators, which a test would consume, are not looked into."""

    def test(values: Any) -> bool:
        if not isinstance(values, Iterable) or isinstance(values, str | bytes | Mapping | Set):
            return False
        if not isinstance(values, Sequence | np.ndarray):
            return True
        return length in (None, len(values)) and all(map(item.test, values))

    return _Kind(f"a sequence of {item.many}", "", test)


def _kinds_of(function: Callable[..., Any]) -> dict[str, _Kind]:
    """Return the kinds of the parameters that are checked."""
    kinds = {}
    for name, annotation in inspect.get_annotations(function).items():
        try:
            kind = _kind_of(eval(annotation, function.__globals__))
        except NameError:
            # A class that is imported for type checkers alone.
            continue
        if kind is not None:
            kinds[name] = kind
    return kinds


def check_arguments(function: _Function) -> _Function:
    """Make a function raise TypeError for an argument that its annotation does not accept.

    Checked are annotations of one class, and of built-in types: numbers, texts, paths, functions,
    and sequences and mappings of these. What is one of several classes is left to the function,
    which reads it: an array or an image, settings or their name. The message names the parameter,
    the value and what is accepted.
    """
    parameters = inspect.signature(function).parameters
    names = tuple(parameters)
    optional = {name for name, parameter in parameters.items() if parameter.default is None}
    # Read at the first call, when all classes are defined.
    kinds_of = functools.cache(_kinds_of)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        # pytest shows the call in the test, and not this function.
        __tracebackhide__ = True
        kinds = kinds_of(function)
        # Too many and unknown arguments are left to Python's own error.
        for name, value in (*zip(names, args, strict=False), *kwargs.items()):
            if name not in kinds or (value is None and name in optional):
                continue
            if not kinds[name].test(value):
                raise TypeError(f"{name}: {reprlib.repr(value)} is not {kinds[name].what}")
        return function(*args, **kwargs)

    return cast("_Function", call)
