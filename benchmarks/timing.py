"""Times of contenders that take turns, and ratios of these times."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vkbloom import AdapterInfo, Frames

__all__ = [
    "Contender",
    "Ratio",
    "Times",
    "alternate",
    "alternate_seconds",
    "device_clock",
    "wall_clock",
]


@dataclass(frozen=True)
class Contender:
    """One implementation of the work that is timed.

    Parameters
    ----------
    name : str
        Its name in tables.
    call : callable
        Takes the number of the round, from 0, and does the work once. Its result is freed after
        the clock has stopped.
    seconds : callable, optional
        Takes the result of `call` and returns the seconds measured by a device. Default: the wall
        clock.
    """

    name: str
    call: Callable[[int], Any]
    seconds: Callable[[Any], float] | None = None


@dataclass(frozen=True)
class Times:
    """The seconds of each round of one contender, in the order of the rounds."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """The median of the rounds, in seconds."""
        return statistics.median(self.seconds)

    @property
    def least(self) -> float:
        """The fastest round, in seconds."""
        return min(self.seconds)

    def over(self, other: Times) -> Ratio:
        """Return how many times as long as `other` this takes.

        The value is the ratio of the medians. Its spread is given by the quartiles of the ratios of
        single rounds, in which both ran shortly after each other.
        """
        each = [a / b for a, b in zip(self.seconds, other.seconds, strict=True) if b > 0]
        if not each or other.median <= 0:
            return Ratio(float("nan"), float("nan"), float("nan"))
        low, high = _quartiles(each)
        return Ratio(self.median / other.median, low, high)

    def minus(self, other: Times) -> Times:
        """Return the differences of the rounds."""
        return Times(tuple(a - b for a, b in zip(self.seconds, other.seconds, strict=True)))

    def quartiles(self) -> tuple[float, float]:
        """Return the first and the third quartile of the rounds, in seconds."""
        return _quartiles(self.seconds)


@dataclass(frozen=True)
class Ratio:
    """A ratio of medians with the quartiles of the single ratios."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3g} ({self.low:.3g} to {self.high:.3g})"


def _quartiles(values: Sequence[float]) -> tuple[float, float]:
    if len(values) < 2:
        return values[0], values[0]
    low, _, high = statistics.quantiles(values, n=4, method="inclusive")
    return low, high


def alternate(
    contenders: Sequence[Contender], rounds: int, *, warm_up: int = 2
) -> dict[str, Times]:
    """Time contenders with different names in turn: A B C A B C and so on.

    So a disturbance, such as another clock rate or program, affects all of them. `warm_up`: rounds
    before that do not count: compilation, first use of memory.
    """
    names = [contender.name for contender in contenders]
    if len(set(names)) != len(names):
        raise ValueError(f"contenders: {names!r} has a name twice")
    return alternate_seconds(
        {one.name: wall_clock(one.call, one.seconds) for one in contenders},
        rounds,
        warm_up=warm_up,
    )


def wall_clock(
    call: Callable[[int], Any], seconds: Callable[[Any], float] | None = None
) -> Callable[[int], float]:
    """Return a call that does the work once, and returns its seconds by the wall clock or another.

    The result is freed after the clock has stopped.
    """

    def once(turn: int) -> float:
        start = time.perf_counter()
        result = call(turn)
        wall = time.perf_counter() - start
        return wall if seconds is None else seconds(result)

    return once


def alternate_seconds(
    calls: Mapping[str, Callable[[int], float]], rounds: int, *, warm_up: int = 0
) -> dict[str, Times]:
    """Do the same as `alternate` for calls that return their seconds."""
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    was_enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for turn in range(warm_up + rounds):
            for name, call in calls.items():
                duration = call(turn)
                if turn >= warm_up:
                    seconds[name].append(duration)
    finally:
        if was_enabled:
            gc.enable()
    return {name: Times(tuple(durations)) for name, durations in seconds.items()}


def device_clock(adapter: AdapterInfo) -> Callable[[Frames], float] | None:
    """Return a function from frames to the seconds of their passes, by timestamps on a GPU.

    None for CPU adapters, which means the wall clock: lavapipe 22.3.6 writes timestamps around
    compute before the work is done, so that they read near zero.
    """
    if adapter.type == "cpu":
        return None
    return lambda frames: sum(frames.timings.values())
