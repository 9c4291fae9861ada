"""Public classes and functions say where users find them, not where they are defined."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, Final, TypeVar

T = TypeVar("T")

_DEFINED_IN: Final = "_defined_in"


def public(module: str) -> Callable[[T], T]:
    """Return a decorator that makes a public module the `__module__` of a class or function.

    Pickles, Dask's graphs and tracebacks have this name, so that the defining module can move. It
    is the outermost decorator: `dataclasses.dataclass` looks names up in the defining module.
    """

    def decorate(thing: T) -> T:
        if isinstance(thing, type):
            # Evaluated now: later, their names would be looked up in the public module.
            thing.__annotations__ = inspect.get_annotations(thing, eval_str=True)
        setattr(thing, _DEFINED_IN, thing.__module__)
        thing.__module__ = module
        return thing

    return decorate


def defining_module(thing: Any) -> str:
    """Return the name of the module that has the source of a class or function."""
    # Not that of a base class, which a user's class inherits.
    return str(vars(thing).get(_DEFINED_IN, thing.__module__))
