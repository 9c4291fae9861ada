"""Times of contenders that take turns, and ratios of these times, each with an interval."""

from __future__ import annotations

import functools
import gc
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from vkbloom import AdapterInfo, Frames

__all__ = [
    "PASSES",
    "PROCESSOR",
    "WALL",
    "Contender",
    "Estimate",
    "Rounds",
    "Times",
    "alternate",
    "alternate_seconds",
    "device_clock",
    "estimate",
    "processor_clock",
    "wall_clock",
]

#: The clocks: of the wall; of the passes, or of other work, on a GPU; of all threads together.
WALL: Final = "wall"
PASSES: Final = "passes"
PROCESSOR: Final = "processor"

#: The probability that an interval contains the median, where there are rounds enough for it.
CONFIDENCE: Final = 0.95
#: The least number of rounds, however long they take.
MIN_ROUNDS: Final = 3
#: Rounds end once each interval is at most this wide, relative to its median.
WIDTH: Final = 0.03


class Estimate(NamedTuple):
    """A median with its interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3g} ({self.low:.3g} to {self.high:.3g})"

    @property
    def width(self) -> float:
        """The width of the interval, relative to the median."""
        return (self.high - self.low) / self.value if self.value > 0 else math.inf


def estimate(values: Sequence[float]) -> Estimate:
    """Estimate the median that values are drawn around.

    The interval lies between two of the values in their order: each value is below the median with
    the probability one half, whatever the distribution is, so that the binomial distribution gives
    their places. Of fewer than six values the interval holds all, and is less certain.
    """
    ordered = sorted(values)
    count = len(ordered)
    outside, place = 0.5**count, 0
    # The probability that at most `place` values are below the median.
    while 2 * (more := outside + math.comb(count, place + 1) * 0.5**count) <= 1 - CONFIDENCE:
        outside, place = more, place + 1
    return Estimate(statistics.median(ordered), ordered[place], ordered[count - 1 - place])


class Rounds(NamedTuple):
    """How many rounds are timed: `least`, then more while an interval is wide.

    - `most`: The largest number.
    - `seconds`: No round is begun after so many seconds, but the first `MIN_ROUNDS`.
    """

    least: int
    most: int
    seconds: float


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

    @property
    def clock(self) -> str:
        """The clock of its times."""
        return WALL if self.seconds is None else PASSES


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

    def estimate(self) -> Estimate:
        """Return the median with its interval, in seconds."""
        return estimate(self.seconds)

    def over(self, other: Times) -> Estimate:
        """Return how many times as long as `other` this takes.

        It is the median of the ratios of single rounds, in which both ran shortly after each other.
        """
        each = [a / b for a, b in zip(self.seconds, other.seconds, strict=True) if b > 0]
        return estimate(each) if each else Estimate(math.nan, math.nan, math.nan)

    def minus(self, other: Times) -> Times:
        """Return the differences of the rounds."""
        return Times(tuple(a - b for a, b in zip(self.seconds, other.seconds, strict=True)))

    def plus(self, other: Times) -> Times:
        """Return the sums of the rounds."""
        return Times(tuple(a + b for a, b in zip(self.seconds, other.seconds, strict=True)))


def alternate(
    contenders: Sequence[Contender], rounds: Rounds, *, warm_up: int = 2
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

    The result is freed after the clock has stopped. What the clock itself takes is subtracted.
    """
    return _host_clock(time.perf_counter, call, seconds)


def processor_clock(call: Callable[[int], Any]) -> Callable[[int], float]:
    """Do the same by the processor time of all threads, which other programs change less."""
    return _host_clock(time.process_time, call, None)


def _host_clock(
    clock: Callable[[], float],
    call: Callable[[int], Any],
    seconds: Callable[[Any], float] | None,
) -> Callable[[int], float]:
    overhead = _overhead(clock)

    def once(turn: int) -> float:
        start = clock()
        result = call(turn)
        elapsed = clock() - start
        return max(elapsed - overhead, 0.0) if seconds is None else seconds(result)

    return once


@functools.cache
def _overhead(clock: Callable[[], float]) -> float:
    """Return the seconds that a clock counts for a call that does nothing."""

    def nothing(_: int) -> None:
        pass

    found = []
    for turn in range(101):
        start = clock()
        nothing(turn)
        found.append(clock() - start)
    return statistics.median(found)


def alternate_seconds(
    calls: Mapping[str, Callable[[int], float]], rounds: Rounds, *, warm_up: int = 0
) -> dict[str, Times]:
    """Do the same as `alternate` for calls that return their seconds."""
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    was_enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for turn in range(warm_up):
            for call in calls.values():
                call(turn)
        start = time.perf_counter()
        for turn in range(rounds.most):
            if turn >= MIN_ROUNDS and time.perf_counter() - start > rounds.seconds:
                break
            if turn >= rounds.least and _are_narrow(seconds):
                break
            for name, call in calls.items():
                seconds[name].append(call(warm_up + turn))
    finally:
        if was_enabled:
            gc.enable()
    return {name: Times(tuple(durations)) for name, durations in seconds.items()}


def _are_narrow(seconds: Mapping[str, Sequence[float]]) -> bool:
    return all(estimate(each).width <= WIDTH for each in seconds.values())


def device_clock(adapter: AdapterInfo) -> Callable[[Frames], float] | None:
    """Return a function from frames to the seconds of their passes, by timestamps on a GPU.

    None for CPU adapters, which means the wall clock: lavapipe 22.3.6 writes timestamps around
    compute before the work is done, so that they read near zero.
    """
    if adapter.type == "cpu":
        return None
    return lambda frames: sum(frames.timings.values())
