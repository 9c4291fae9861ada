"""Old names: they work for two minor versions, with a DeprecationWarning that says the new one."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple, ParamSpec, TypeVar

__all__ = ["NAMES", "Renamed", "renamed_arguments", "warn"]

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")


class Renamed(NamedTuple):
    """The new name, the version that brought it, and the version that removes the old one."""

    new: str
    since: str
    until: str


#: Old names of the package, such as ``vkbloom.fit_levels``.
NAMES: Final[Mapping[str, Renamed]] = {}


def warn(old: str, what: Renamed, level: int = 2) -> None:
    """Warn about an old name.

    `level`: Callers up to the user's code, as `stacklevel` of a function that calls this one.
    """
    warnings.warn(
        f"{old}: renamed in vkbloom {what.since} and removed in {what.until}; use {what.new}",
        DeprecationWarning,
        stacklevel=level + 1,
    )


def renamed_arguments(
    **old: Renamed,
) -> Callable[[Callable[_Parameters, _Result]], Callable[_Parameters, _Result]]:
    """Return a decorator of functions whose keyword arguments have old names, too."""

    def decorate(function: Callable[_Parameters, _Result]) -> Callable[_Parameters, _Result]:
        @functools.wraps(function)
        def call(*args: Any, **options: Any) -> _Result:
            for name in old.keys() & options.keys():
                what = old[name]
                if what.new in options:
                    raise TypeError(f"{name}: {what.new} is its new name; give one of them")
                warn(name, what)
                options[what.new] = options.pop(name)
            return function(*args, **options)

        return call

    return decorate
