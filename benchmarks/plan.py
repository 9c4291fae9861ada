"""What to run, how often, at which size, on which adapter."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import vkbloom
from benchmarks.timing import Rounds

#: Selects the variants of passes for renderers that are made while it is set.
VARIANTS_VARIABLE = "VKBLOOM_VARIANT"


def usable_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _silent(_: str) -> None:
    pass


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How benchmarks are run.

    Parameters
    ----------
    adapter : str
        As for `vkbloom.Renderer`.
    quick : bool
        Small images and few rounds: a check that everything runs. The figures mean nothing.
    rounds : int or None
        Rounds for each contender, at least 3. None: the benchmark's own number, and up to four
        times as many while intervals are wide.
    seconds : float
        A group of contenders begins no round after so many seconds, but the first three.
    requests : int
        Number of requests of the benchmark "requests", at least 1.
    threads : int
        Threads of the peers that have such a setting, at least 1.
    only : tuple of str
        Ids of benchmarks; empty: all.
    tell : callable
        Gets a short text about what is being timed.

    Raises
    ------
    ValueError
        A number is out of its range.
    """

    adapter: str = "auto"
    quick: bool = False
    rounds: int | None = None
    seconds: float = 10.0
    requests: int = 10_000
    threads: int = field(default_factory=usable_cores)
    only: tuple[str, ...] = ()
    tell: Callable[[str], None] = _silent

    def __post_init__(self) -> None:
        for name, least in (("rounds", 3), ("requests", 1), ("threads", 1)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise ValueError(f"{name}: {value!r} is out of range, {least} or more")

    def times(self, usual: int) -> Rounds:
        """Return the number of rounds; `usual` is the least number of the benchmark itself."""
        if self.quick or self.rounds is not None:
            count = self.rounds or 3
            return Rounds(count, count, math.inf)
        return Rounds(usual, 4 * usual, self.seconds)

    def size(self, width: int, height: int) -> tuple[int, int]:
        """Return the size to run at; --quick reduces it to about 256 a side."""
        factor = -(-max(width, height) // 256) if self.quick else 1
        return max(1, width // factor), max(1, height // factor)

    def renderer(self, variant: str = "auto") -> vkbloom.Renderer:
        """Make a renderer with VKBLOOM_VARIANT set to `variant`."""
        with _environment(VARIANTS_VARIABLE, variant):
            return vkbloom.Renderer(self.adapter)


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
