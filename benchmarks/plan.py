"""What to run: how often, how large, on which adapter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import vkbloom

#: Chooses the forms of the passes of the renderers that are made under it.
FORM_VARIABLE = "VKBLOOM_FORM"


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
        Small images and few rounds: shows that all works, its figures mean nothing.
    rounds : int or None
        How often each contender is timed; None: what the benchmark thinks fit. At least 3.
    points : int
        Settings of the benchmark "points", at least 1.
    threads : int
        Of the peers that take a number, at least 1.
    only : tuple of str
        Ids of benchmarks; none: all.
    tell : callable
        Is told in a few words what is being timed.

    Raises
    ------
    ValueError
        A number is out of its range.
    """

    adapter: str = "auto"
    quick: bool = False
    rounds: int | None = None
    points: int = 10_000
    threads: int = field(default_factory=usable_cores)
    only: tuple[str, ...] = ()
    tell: Callable[[str], None] = _silent

    def __post_init__(self) -> None:
        for name, least in (("rounds", 3), ("points", 1), ("threads", 1)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise ValueError(f"{name}: {value!r} is out of range, {least} or more")

    def times(self, usual: int) -> int:
        """Return the rounds to run where `usual` is what the benchmark thinks fit."""
        return self.rounds or (3 if self.quick else usual)

    def size(self, width: int, height: int) -> tuple[int, int]:
        """Return the size to run at, which --quick reduces to about 256 a side."""
        factor = -(-max(width, height) // 256) if self.quick else 1
        return max(1, width // factor), max(1, height // factor)

    def renderer(self, form: str = "auto") -> vkbloom.Renderer:
        """Make a renderer whose passes have the forms that VKBLOOM_FORM `form` stands for."""
        with _environment(FORM_VARIABLE, form):
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
