"""All laws by name, and the choice of laws and limits by names that users give."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from types import ModuleType
from typing import Final

from vkbloom._numbers import check_number
from vkbloom._spelling import did_you_mean
from vkbloom.testing._laws import (
    adaptation,
    alpha,
    border,
    bounds,
    composite,
    field,
    light,
    linear,
    scene,
    shape,
    spread,
    time,
    values,
    views,
)
from vkbloom.testing._laws.law import Law, Limits

__tracebackhide__ = True

#: Modules whose objects of the class `Law` are the laws of a bloom, in the order of the report.
_MODULES: Final = (
    linear,
    spread,
    bounds,
    composite,
    light,
    field,
    scene,
    border,
    views,
    shape,
    alpha,
    time,
    values,
)


def _laws_of(*modules: ModuleType) -> dict[str, Law]:
    laws = (law for module in modules for law in vars(module).values() if isinstance(law, Law))
    return {law.name: law for law in laws}


#: The laws of a bloom by name.
LAWS: Final[Mapping[str, Law]] = _laws_of(*_MODULES)
#: Those of an exposure.
EXPOSURE_LAWS: Final[Mapping[str, Law]] = _laws_of(adaptation)
#: Both.
ALL_LAWS: Final[Mapping[str, Law]] = {**LAWS, **EXPOSURE_LAWS}


def find_law(name: str, known: Collection[str] = ALL_LAWS.keys()) -> str:
    """Return the name of a known law; a hyphen stands for an underscore.

    - Raises TypeError if it is no text, and ValueError if there is no such law.
    """
    if not isinstance(name, str):
        raise TypeError(f"{name!r} is not the name of a law, a str")
    plain = name.strip().replace("-", "_")
    if plain not in known:
        raise ValueError(f"{name!r} is not one of {', '.join(known)}{did_you_mean(plain, known)}")
    return plain


def merge_limits(
    given: Mapping[str, Mapping[str, float]], tested: Collection[str] = ALL_LAWS.keys()
) -> dict[str, Limits]:
    """Return the limits of the laws to test, with the given ones in place of their own.

    - Raises ValueError for a law that is unknown or not tested, a figure without a limit, and a
      value out of range; TypeError for what is no mapping of numbers.
    """
    if not isinstance(given, Mapping):
        raise TypeError(f"limits: {given!r} is not a mapping of laws to mappings of figures")
    results: dict[str, Limits] = {name: ALL_LAWS[name].limits for name in tested}
    for key, changes in given.items():
        try:
            name = find_law(key)
        except (TypeError, ValueError) as error:
            raise type(error)(f"limits: {error}") from None
        if name not in results:
            raise ValueError(f"limits: {name} is not tested; tested are {', '.join(tested)}")
        if not isinstance(changes, Mapping):
            raise TypeError(
                f"limits: {name}: {changes!r} is not a mapping of figures to numbers, such as "
                f"{dict([*results[name].items()][:1])}"
            )
        for figure, limit in changes.items():
            if figure not in results[name]:
                near = did_you_mean(figure, results[name])
                raise ValueError(
                    f"limits: {name}: {figure!r} is not one of {', '.join(results[name])}{near}"
                )
            check_number(f"limits: {name}: {figure}", limit, 0.0, math.inf)
        results[name] = {**results[name], **changes}
    return results
