"""What the usual run takes a part of. VKBLOOM_EXHAUSTIVE=1 (make exhaustive) takes all of it."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Sequence
from typing import Any, Final, TypeVar

#: Whether this run takes everything.
EXHAUSTIVE: Final = os.environ.get("VKBLOOM_EXHAUSTIVE", "0") not in ("", "0")

T = TypeVar("T")


def some(cases: Iterable[T], count: int) -> list[T]:
    """Return `count` cases, the first, the last and evenly between; all in an exhaustive run."""
    every = list(cases)
    if EXHAUSTIVE or count >= len(every):
        return every
    if count == 1:
        return every[:1]
    return [every[round(i * (len(every) - 1) / (count - 1))] for i in range(count)]


def pairs(*lists: Sequence[Any]) -> list[tuple[Any, ...]]:
    """Return cases with every value of the first two lists together, the others in turn; the whole
    product in an exhaustive run."""
    if EXHAUSTIVE:
        return list(itertools.product(*lists))
    first, second, *others = lists
    cases = []
    for (i, one), (j, two) in itertools.product(enumerate(first), enumerate(second)):
        case, turn = [one, two], i + j
        for other in others:
            case.append(other[turn % len(other)])
            turn //= len(other)
        cases.append(tuple(case))
    return cases


def examples(usual: int) -> int:
    """Return the number of examples of a hypothesis test; eight times as many when exhaustive."""
    return 8 * usual if EXHAUSTIVE else usual
