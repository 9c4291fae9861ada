"""The constant cost of a call, split into Python, passes and readback.

The image is so small that the constant cost of the call dominates. NumPy in and out; wall-clock
time. The control is a second renderer of the same kind: its difference is noise.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks.image import SETTINGS
from benchmarks.inputs import COUNT, pictures
from benchmarks.ours import OURS
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, Table, side_by_side
from benchmarks.timing import Contender, Times, alternate, alternate_seconds

__all__ = ["run"]

SIZE: Final = (64, 64)
ROUNDS: Final = 101
LOOPS: Final = 8
FRAGMENT: Final = "vkbloom, plain fragment variant"
AGAIN: Final = "vkbloom once more, a control"

Case = Callable[[vkbloom.Renderer, int], vkbloom.Frames]


class _Stopwatch:
    """A renderer's core, or a submission, that counts the seconds spent in its calls."""

    def __init__(self, core: Any, watch: _Stopwatch | None = None) -> None:
        self._core = core
        self._watch = watch or self
        self.seconds = 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._core, name)

    def _call(self, method: Callable[..., Any], *arguments: Any) -> Any:
        start = time.perf_counter()
        result = method(*arguments)
        self._watch.seconds += time.perf_counter() - start
        return result

    def plan(self, *arguments: Any) -> Any:
        return self._call(self._core.plan, *arguments)

    def pages(self, size: int) -> Any:
        return self._call(self._core.pages, size)

    def run(self, *arguments: Any) -> Any:
        return _Stopwatch(self._call(self._core.run, *arguments), self)

    def wait(self) -> Any:
        return self._call(self._core.wait)


def run(plan: Plan, section: Section) -> None:
    """Time calls on 64 x 64 pixels, against the fragment variant and by the work they do."""
    section.title = f"A call on {SIZE[0]} x {SIZE[1]}, float16 RGBA"
    images = pictures(SIZE, np.float16)
    rounds = plan.times(ROUNDS)
    with ExitStack() as stack:
        made = {
            name: stack.enter_context(plan.renderer(variant))
            for name, variant in ((OURS, "auto"), (FRAGMENT, "fragment"), (AGAIN, "auto"))
        }
        times = alternate(
            [
                Contender(
                    name,
                    lambda turn, renderer=renderer: renderer.apply(  # type: ignore[misc]
                        images[turn % COUNT], SETTINGS, framebuffers=("final",)
                    ),
                )
                for name, renderer in made.items()
            ],
            rounds,
            warm_up=5,
        )
        section.times["variants"] = times
        section.tables.append(side_by_side("Another image in each call", times, OURS))
        ratio = times[OURS].over(times[FRAGMENT]).value
        # The two should be equal; medians of equal work differ by up to 5 %.
        section.goals.append(
            Goal("64 x 64: vkbloom / plain fragment variant", ratio, 1.05, at_most=True)
        )
        _split(section, made[OURS], images, rounds)


def _cases(images: list[NDArray[Any]]) -> dict[str, Case]:
    """Return calls that cause different work."""
    image = images[0]
    final = ("final",)

    def again(renderer: vkbloom.Renderer, _: int) -> vkbloom.Frames:
        return renderer.apply(image, SETTINGS, framebuffers=final)

    def composite(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(intensity=0.5 + 0.001 * turn)
        return renderer.apply(image, settings, framebuffers=final)

    def blur(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(blur_strength=0.5 + 0.001 * turn)
        return renderer.apply(image, settings, framebuffers=final)

    def everything(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        return renderer.apply(images[turn % COUNT], SETTINGS, framebuffers=final)

    def all_read(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        return renderer.apply(images[turn % COUNT], SETTINGS)

    def loops(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(loops=LOOPS)
        return renderer.apply(images[turn % COUNT], settings, framebuffers=final)

    return {
        "nothing runs: same image, same settings": again,
        "other intensity": composite,
        "other blur_strength": blur,
        "another image": everything,
        "another image, all framebuffers read back": all_read,
        f"another image, {LOOPS} loops": loops,
    }


def _split(
    section: Section, renderer: vkbloom.Renderer, images: list[NDArray[Any]], rounds: int
) -> None:
    """Add the table of where calls spend their time."""
    watch = _Stopwatch(renderer._core)
    renderer._core = watch  # type: ignore[assignment]
    calls: dict[str, Times] = {}
    inside: dict[str, Times] = {}
    passes: dict[str, int] = {}
    device: dict[str, float] = {}
    for name, case in _cases(images).items():
        core_seconds: list[float] = []

        def once(
            turn: int, case: Case = case, name: str = name, spent: list[float] = core_seconds
        ) -> float:
            watch.seconds = 0.0
            start = time.perf_counter()
            frames = case(renderer, turn)
            wall = time.perf_counter() - start
            spent.append(watch.seconds)
            passes[name] = len(frames.timings)
            device[name] = sum(frames.timings.values())
            return wall

        # Not in turn: the work of a case depends on the call before.
        calls[name] = alternate_seconds({name: once}, rounds, warm_up=3)[name]
        inside[name] = Times(tuple(core_seconds[3:]))
    section.times["calls"] = calls
    section.times["calls, in the core"] = inside
    is_gpu = renderer.info.type != "cpu"
    rows = tuple(
        (
            name,
            str(passes[name]),
            f"{1e6 * calls[name].median:.0f}",
            f"{1e6 * inside[name].median:.0f}",
            f"{1e6 * (calls[name].median - inside[name].median):.0f}",
            *([f"{1e6 * device[name]:.0f}"] if is_gpu else []),
        )
        for name in calls
    )
    header = ["", "passes", "call, us", "in the core, us", "in Python, us"]
    if is_gpu:
        header.append("on the device, us")
    section.tables.append(Table("Where a call spends its time", tuple(header), rows))
    section.about.append(_reading(calls, passes, list(calls)))


def _reading(calls: dict[str, Times], passes: dict[str, int], names: list[str]) -> str:
    nothing, _, _, another, all_read, loops = names
    a_pass = (calls[loops].median - calls[another].median) / max(1, passes[loops] - passes[another])
    return (
        f"A call that runs no pass costs {1e6 * calls[nothing].median:.0f} us (checks, comparison "
        f"of the image, submission, readback). Each pass of this size adds {1e6 * a_pass:.0f} us "
        f"(recording and running: {LOOPS} loops against one). Reading back all framebuffers in "
        "place of `final` adds "
        f"{1e6 * (calls[all_read].median - calls[another].median):.0f} us."
    )
