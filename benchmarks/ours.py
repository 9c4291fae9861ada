"""The contenders of vkbloom, and the contest that every benchmark holds."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

import vkbloom
from benchmarks.inputs import COUNT
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, agreement, equality, side_by_side
from benchmarks.timing import Contender, Times, alternate, device_clock

__all__ = ["FRAGMENT", "OURS", "contender", "contest", "prepare_call", "prepare_child", "ratios"]

OURS: Final = "vkbloom"
#: The longest time of a child process.
MAX_SECONDS: Final = 120
FRAGMENT: Final = "vkbloom, the source's fragment variant"


def prepare_call(
    renderer: vkbloom.Renderer,
    images: Sequence[NDArray[Any]],
    settings: vkbloom.Settings,
) -> Callable[[int], vkbloom.Frames]:
    """Return a call that renders the bloom of another image in each round."""
    return lambda turn: renderer.apply(images[turn % COUNT], settings, framebuffers=("final",))


def contender(
    name: str,
    renderer: vkbloom.Renderer,
    images: Iterator[NDArray[Any]],
    settings: vkbloom.Settings,
) -> Contender:
    """Return a contender that renders the bloom of the next image, with the device's clock on GPUs.

    All contenders of a renderer share one iterator, whose images all differ from the one before. A
    call with the image of the previous call would not run all passes.
    """
    return Contender(
        name,
        lambda _: renderer.apply(next(images), settings, framebuffers=("final",)),
        device_clock(renderer.info),
    )


def contest(
    plan: Plan,
    section: Section,
    group: str,
    contenders: Iterable[Contender],
    rounds: int,
    *,
    pictures: Iterable[tuple[str, NDArray[Any], NDArray[Any]]] = (),
    allowed: tuple[float, str] | None = None,
    caption: str | None = None,
    ours: str = OURS,
    warm_up: int = 2,
) -> dict[str, Times]:
    """Time contenders in turn, except those with another picture; add times, table, agreements.

    - `pictures`: Names of contenders, the picture that each must make, and the one that it makes.
    - `allowed`: The largest difference, and the reason for it. None: the pictures are vkbloom's,
      and have the tolerance of its tests.
    """
    wrong = set()
    for name, expected, made in pictures:
        what = f"{group}: {name}"
        if allowed is None:
            found = equality(what, expected, made)
        else:
            found = agreement(what, expected, made, *allowed)
        section.agreements.append(found)
        if not found.agrees:
            wrong.add(name)
    contenders = [each for each in contenders if each.name not in wrong]
    times = alternate(
        contenders,
        plan.times(rounds),
        warm_up=warm_up,
    )
    clocks = {each.name: each.clock for each in contenders}
    section.add_times(group, times, clocks, ours)
    section.tables.append(side_by_side(group if caption is None else caption, times, ours))
    return times


def ratios(
    section: Section,
    group: str,
    times: dict[str, Times],
    *wanted: tuple[str, str, float, bool],
) -> None:
    """Add goals, each a contender, another one, their ratio, and whether it is the largest one."""
    for one, other, ratio, at_most in wanted:
        if one in times and other in times:
            measured = times[one].over(times[other])
            section.goals.append(Goal(f"{group}: {one} / {other}", measured, ratio, at_most))


def prepare_child(
    code: str, arguments: Sequence[str], caches: Path | None = None, *, of_driver: bool = True
) -> Callable[[], str]:
    """Return a call that runs Python code in a fresh process, and returns what that prints.

    - `caches`: The folder of the caches of vkbloom and of the driver. None: the usual ones.
    - `of_driver`: Whether the driver has a cache there, or none.
    """
    environment = dict(os.environ)
    if caches is not None:
        drivers = caches / "driver"
        drivers.mkdir(parents=True, exist_ok=True)
        environment["VKBLOOM_CACHE_DIR"] = str(caches / "vkbloom")
        # For Mesa and NVIDIA.
        for variable in ("MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH"):
            environment[variable] = str(drivers)
    if not of_driver:
        environment["MESA_SHADER_CACHE_DISABLE"] = "true"
        environment["__GL_SHADER_DISK_CACHE"] = "0"

    def call() -> str:
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            env=environment,
            capture_output=True,
            text=True,
            timeout=MAX_SECONDS,
            check=False,
        )
        if done.returncode != 0:
            raise RuntimeError(f"a child process failed: {done.stderr.strip()[-500:]}")
        return done.stdout

    return call
