"""The contenders of vkbloom, and the contest that every benchmark holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final

from numpy.typing import NDArray

import vkbloom
from benchmarks.inputs import COUNT
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, agreement, side_by_side
from benchmarks.timing import Contender, Times, alternate, device_clock

__all__ = ["FRAGMENT", "OURS", "contender", "contest", "prepare_call", "ratios"]

OURS: Final = "vkbloom"
FRAGMENT: Final = "vkbloom, the source's fragment variant"


def prepare_call(
    renderer: vkbloom.Renderer,
    images: Sequence[NDArray[Any]],
    settings: vkbloom.Settings,
    name: str = "final",
    first: int = 0,
) -> Callable[[int], vkbloom.Frames]:
    """Return a call that renders a framebuffer of another image in each round."""
    return lambda turn: renderer.apply(
        images[(turn + first) % COUNT], settings, framebuffers=(name,)
    )


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
    allowed: tuple[float, str] = (0.0, ""),
    caption: str | None = None,
    ours: str = OURS,
    warm_up: int = 2,
) -> dict[str, Times]:
    """Time contenders in turn, except those with another picture; add times, table, agreements.

    - `pictures`: Names of contenders, the picture that each must make, and the one that it makes.
    - `allowed`: The largest difference, and the reason for it.
    """
    wrong = set()
    for name, expected, made in pictures:
        found = agreement(f"{group}: {name}", expected, made, *allowed)
        section.agreements.append(found)
        if not found.agrees:
            wrong.add(name)
    times = alternate(
        [each for each in contenders if each.name not in wrong],
        plan.times(rounds),
        warm_up=warm_up,
    )
    section.times[group] = times
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
            measured = times[one].over(times[other]).value
            section.goals.append(Goal(f"{group}: {one} / {other}", measured, ratio, at_most))
