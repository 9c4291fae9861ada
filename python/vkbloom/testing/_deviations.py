"""How far a bloom is from a law: the figures, and the assertion that they are within the limit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from vkbloom.testing._probe import Image

__tracebackhide__ = True


class NotTaken(ValueError):
    """A bloom does not take what a law needs, such as a region or alpha; so it is not tested."""


@dataclass(frozen=True)
class Deviation:
    """A deviation from a law, and the largest that is allowed; infinity for a mere figure."""

    law: str
    off: float
    allowed: float
    name: str


#: The name of a figure, the deviation, the limit, and what is wrong where it is beyond the limit.
Measured = tuple[str, float, float, str]

_measured: ContextVar[list[Deviation] | None] = ContextVar("measured", default=None)


@contextmanager
def measuring() -> Iterator[list[Deviation]]:
    """Collect the deviations of all assertions inside, up to the first one that fails."""
    results: list[Deviation] = []
    token = _measured.set(results)
    try:
        yield results
    finally:
        _measured.reset(token)


def is_within(law: str, off: float, allowed: float, name: str = "off") -> bool:
    """Return whether a deviation is within its limit; NaN is not."""
    result = _measured.get()
    if result is not None:
        result.append(Deviation(law, off, allowed, name))
    return off <= allowed


def breaches(law: str, measured: Iterable[Measured]) -> list[str]:
    """Return what is wrong with each deviation that is beyond its limit."""
    return [text for name, off, limit, text in measured if not is_within(law, off, limit, name)]


def judge(law: str, *measured: Measured) -> None:
    """Raise AssertionError with what is wrong with the deviations beyond their limits, if any."""
    if reasons := breaches(law, measured):
        fail(law, "; ".join(reasons))


def figure(name: str, value: float) -> None:
    """Collect a figure that has no limit."""
    is_within("", value, math.inf, name)


def compare_with_law(
    law: str, actual: Image, expected: Image, allowed: float, note: str = ""
) -> None:
    """Raise AssertionError with the deviation, its position and the law if a value is wrong."""
    difference = np.abs(actual - expected)
    position = np.unravel_index(int(difference.argmax()), difference.shape)
    y, x, channel = map(int, position)
    off = float(difference[position])
    text = (
        f"{actual[position]:.6g} instead of {expected[position]:.6g} at x {x}, y {y}, channel "
        f"{channel}: off by {off:.3g}, {allowed:.3g} allowed{note}"
    )
    judge(law, ("off", off, allowed, text))


def fail(law: str, figure: str) -> NoReturn:
    """Raise AssertionError with the figure and the law."""
    raise AssertionError(f"{figure}\n  law: {law}")
