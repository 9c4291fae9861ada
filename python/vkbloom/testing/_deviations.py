"""How far a bloom is from a law: the figures, and the assertion that they are within the limit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Final, NoReturn

import numpy as np

from vkbloom.testing._probe import Error, Image, Probe

__tracebackhide__ = True

# A deviation of this share of the largest value must be seen where a law counts as held.
_SEEN: Final = 0.1


@dataclass(frozen=True)
class LawDeviation:
    """A deviation from a law, and the largest that is allowed; infinity for a mere figure."""

    law: str
    off: float
    allowed: float
    name: str


#: The name of a figure, the deviation, the limit, what is wrong where it is beyond the limit, and
#: the error of the deviation, where the levels of values matter.
Measured = tuple[str, float, float, str] | tuple[str, float, float, str, float]

_measured: ContextVar[list[LawDeviation] | None] = ContextVar("measured", default=None)


@contextmanager
def measuring() -> Iterator[list[LawDeviation]]:
    """Collect the deviations of all assertions inside, up to the first one that fails."""
    results: list[LawDeviation] = []
    token = _measured.set(results)
    try:
        yield results
    finally:
        _measured.reset(token)


def is_within(law: str, off: float, allowed: float, name: str = "off") -> bool:
    """Return whether a deviation is within its limit; NaN is not, unless the limit is infinity."""
    result = _measured.get()
    if result is not None:
        result.append(LawDeviation(law, off, allowed, name))
    return off <= allowed or math.isinf(allowed)


@dataclass
class Findings:
    """What is wrong with the deviations from a law, and what the levels of values leave open."""

    law: str
    probe: Probe | None = None
    broken: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)

    def add(self, measured: Iterable[Measured]) -> None:
        """Compare deviations with their limits."""
        for item in measured:
            name, off, limit, text = item[:4]
            error = item[4] if len(item) == 5 else 0.0
            if not is_within(self.law, off, limit + error, name):
                self.broken.append(text)
            elif off > limit - error:
                self.undecided.append(f"{text}, within an error of {error:.3g}")

    def conclude(self) -> None:
        """Raise AssertionError if the law is broken, ValueError if that is undecided."""
        if self.broken:
            fail(self.law, "; ".join(self.broken))
        if self.undecided:
            raise_coarse(self.probe, "; ".join(self.undecided))


def raise_coarse(probe: Probe | None, text: str) -> NoReturn:
    """Raise ValueError, since values have too few levels."""
    levels = None if probe is None else probe.levels
    reason = "values of this accuracy" if levels is None else levels.reason
    raise ValueError(f"cannot be tested in {reason}: {text}")


def judge(law: str, *measured: Measured, probe: Probe | None = None) -> None:
    """Raise AssertionError with what is wrong with the deviations beyond their limits, if any.

    Raise ValueError if none is, but one may be within the error of the figures.
    """
    findings = Findings(law, probe)
    findings.add(measured)
    findings.conclude()


def figure(name: str, value: float) -> None:
    """Collect a figure that has no limit."""
    is_within("", value, math.inf, name)


def compare_with_law(
    probe: Probe,
    law: str,
    actual: Image,
    expected: Image,
    error: Error,
    *,
    limit: float,
    name: str = "off",
    note: str = "",
    seen: float = _SEEN,
) -> None:
    """Raise AssertionError with the deviation, its position and the law if a value is wrong.

    `error` is that of values, beyond which the limit is allowed. Where values have few levels:
    ValueError if a deviation of the share `seen` of the largest expected value is within the error.
    """
    difference = np.abs(actual - expected)
    errors = np.broadcast_to(error, difference.shape)
    position = np.unravel_index(int((difference - errors).argmax()), difference.shape)
    y, x, channel = map(int, position)
    off, allowed = float(difference[position]), float(errors[position]) + limit
    text = (
        f"{actual[position]:.6g} instead of {expected[position]:.6g} at x {x}, y {y}, channel "
        f"{channel}: off by {off:.3g}, {allowed:.3g} allowed{note}"
    )
    judge(law, (name, off, allowed, text))
    largest, coarsest = float(np.abs(expected).max()), float(errors.max())
    hides = not coarsest < seen * largest
    if probe.levels is not None and hides and not math.isinf(limit):
        raise_coarse(
            probe,
            f"values up to {largest:.3g} have errors of {coarsest:.3g}, which hide a deviation of "
            f"{100 * seen:g} %",
        )


def fail(law: str, figure: str) -> NoReturn:
    """Raise AssertionError with the figure and the law."""
    raise AssertionError(f"{figure}\n  law: {law}")
