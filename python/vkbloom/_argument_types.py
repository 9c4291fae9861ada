"""Check the types of the arguments of public functions, by the names of their parameters."""

from __future__ import annotations

import functools
import inspect
import operator
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from vkbloom._numbers import as_float

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Test = Callable[[Any], bool]


class Kind(NamedTuple):
    """What messages call a kind of argument, and its test."""

    what: str
    test: _Test


def _converts(convert: Callable[[Any], Any]) -> _Test:
    """Return a test that holds for what `convert` takes."""

    def test(value: Any) -> bool:
        try:
            convert(value)
        except (TypeError, ValueError, OverflowError, DeprecationWarning):
            # (NumPy deprecates some names of dtypes, which is an error where warnings are.)
            return False
        return True

    return test


def _items(test: _Test, length: int | None = None) -> _Test:
    """Return a test of a sequence and of its items; iterators are not consumed."""

    def test_items(values: Any) -> bool:
        if not isinstance(values, Iterable) or isinstance(values, str | bytes | Mapping | Set):
            return False
        if not isinstance(values, Sequence | np.ndarray):
            return True
        return all(map(test, values)) and length in (None, len(values))

    return test_items


def _is_integer(value: Any) -> bool:
    return not isinstance(value, bool) and _converts(operator.index)(value)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_path(value: Any) -> bool:
    return isinstance(value, str | os.PathLike) and isinstance(os.fspath(value), str)


def _instance_of(name: str) -> Kind:
    """Return the kind of the objects of a class, which this module does not import."""
    return Kind(
        f"a {name}", lambda value: any(base.__name__ == name for base in type(value).__mro__)
    )


ANY = Kind("anything", lambda _: True)
FLAG = Kind("a bool", lambda value: isinstance(value, bool | np.bool_))
INTEGER = Kind("an integer", _is_integer)
NUMBER = Kind("a number", _converts(functools.partial(as_float, "")))
TEXT = Kind("a str", _is_text)
PATH = Kind("a str or a path", _is_path)
FUNCTION = Kind("callable", callable)
LOSS = Kind("a str or callable", lambda value: _is_text(value) or callable(value))
SETTINGS = _instance_of("Settings")
MANY_SETTINGS = Kind(
    "a Settings or a sequence of them",
    lambda value: SETTINGS.test(value) or _is_text(value) or _items(ANY.test)(value),
)
DTYPE = Kind("a dtype", _converts(np.dtype))
TEXTS = Kind("a sequence of str", _items(_is_text))
NAMES = Kind("a str or a sequence of str", lambda value: _is_text(value) or _items(_is_text)(value))
NUMBERS = Kind("a sequence of numbers", _items(NUMBER.test))
PAIR = Kind("a pair of integers", _items(_is_integer, 2))
MAPPING = Kind(
    "a mapping by str", lambda value: isinstance(value, Mapping) and all(map(_is_text, value))
)

#: The kind of a parameter by its name. What is not here is left to the function.
_KINDS: dict[str, Kind] = {
    **dict.fromkeys(("direct", "gradient", "premultiplied", "progress", "raw"), FLAG),
    **dict.fromkeys(("half", "resume", "temporal", "validation", "verify"), FLAG),
    **dict.fromkeys(("bits", "levels", "max_calls", "most", "period"), INTEGER),
    **dict.fromkeys(("quality", "settle", "subimage", "texel", "width"), INTEGER),
    **dict.fromkeys(("expand", "flicker", "gain", "glow_intensity", "growth", "radius"), NUMBER),
    **dict.fromkeys(("intensity", "jitter", "light", "limit", "peak", "ripple", "rtol"), NUMBER),
    **dict.fromkeys(("degrees", "fps", "pixels_per_degree", "steps"), NUMBER),
    **dict.fromkeys(("time", "timeout", "value", "within"), NUMBER),
    **dict.fromkeys(("adapter", "axis", "columns", "framebuffer", "layer", "lines", "name"), TEXT),
    **dict.fromkeys(("device", "encoding", "format", "parameter", "primaries", "rows"), TEXT),
    **dict.fromkeys(("input_colour", "output_colour", "shading", "suffix", "view"), TEXT),
    **dict.fromkeys(("base", "path"), PATH),
    **dict.fromkeys(("framebuffers", "laws", "vary"), NAMES),
    **dict.fromkeys(("argv", "variables"), TEXTS),
    **dict.fromkeys(("brightness", "scales"), NUMBERS),
    **dict.fromkeys(("frames", "values"), Kind("a sequence", _items(ANY.test))),
    **dict.fromkeys(("at", "size"), PAIR),
    **dict.fromkeys(("bounds", "chunks", "limits", "metadata", "out", "reduce", "state"), MAPPING),
    **dict.fromkeys(("bloom", "on_mended", "reference"), FUNCTION),
    "dtype": DTYPE,
    "loss": LOSS,
    "renderer": _instance_of("Renderer"),
    "camera": _instance_of("Camera"),
    "psf": _instance_of("PSF"),
    "probe": _instance_of("Probe"),
    "dataset": _instance_of("Dataset"),
}


def checked_as(**kinds: Kind) -> Callable[[_Function], _Function]:
    """Return `checked` for a function some of whose parameters are of other kinds."""

    def decorate(function: _Function) -> _Function:
        parameters = inspect.signature(function).parameters
        known = {**_KINDS, **kinds}
        tests = {
            name: (known[name], parameter.default is None)
            for name, parameter in parameters.items()
            if name in known
        }
        names = tuple(parameters)

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            # pytest shows the call in the test, and not this function.
            __tracebackhide__ = True
            # Too many and unknown arguments are left to Python's own error.
            for name, value in (*zip(names, args, strict=False), *kwargs.items()):
                if name not in tests or (value is None and tests[name][1]):
                    continue
                what, test = tests[name][0]
                if not test(value):
                    raise TypeError(f"{name}: {reprlib.repr(value)} is not {what}")
            return function(*args, **kwargs)

        return cast("_Function", call)

    return decorate


def checked(function: _Function) -> _Function:
    """Make a function raise TypeError for an argument that is not of its parameter's kind.

    None is accepted where it is the default. The message names the parameter, the value and what is
    accepted.
    """
    return checked_as()(function)
