"""What a call costs whatever its size, and where: Python, each pass, the readback."""

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
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, Table, side_by_side
from benchmarks.timing import Contender, Times, alternate, alternate_seconds

__all__ = ["run"]

SIZE: Final = (64, 64)
ROUNDS: Final = 101
LOOPS: Final = 8
OURS: Final = "vkbloom"
FRAGMENT: Final = "vkbloom, plain fragment form"
AGAIN: Final = "vkbloom once more, a control"

Case = Callable[[vkbloom.Renderer, int], vkbloom.Frames]


class _Stopwatch:
    """The core of a renderer, or a submission, with the seconds that were spent in its calls."""

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


def run(plan: Plan) -> Section:
    """Time calls on 64 x 64 pixels: against the plain form, and by what they have to do."""
    section = Section(
        "overhead",
        f"A call on {SIZE[0]} x {SIZE[1]}, float16 RGBA",
        [
            "So few pixels that what is timed is the call: NumPy in and out, by the wall clock. "
            "The control is another renderer of the same kind; what it differs by is noise.",
        ],
    )
    images = pictures(SIZE, np.float16)
    rounds = plan.times(ROUNDS)
    with ExitStack() as stack:
        made = {
            name: stack.enter_context(plan.renderer(form))
            for name, form in ((OURS, "auto"), (FRAGMENT, "fragment"), (AGAIN, "auto"))
        }
        times = alternate(
            [
                Contender(
                    name,
                    lambda turn, renderer=renderer: renderer.apply(  # type: ignore[misc]
                        images[turn % COUNT], SETTINGS, attachments=("final",)
                    ),
                )
                for name, renderer in made.items()
            ],
            rounds,
            warm_up=5,
        )
        section.times["forms"] = times
        section.tables.append(side_by_side("Another image in each call", times, OURS))
        ratio = times[OURS].over(times[FRAGMENT]).value
        # The two are to be the same; 5 % is what medians of the same differ by.
        section.goals.append(
            Goal("64 x 64: vkbloom / plain fragment form", ratio, 1.05, at_most=True)
        )
        _split(section, made[OURS], images, rounds)
    return section


def _cases(images: list[NDArray[Any]]) -> dict[str, Case]:
    """Return calls that differ in what they make the renderer do."""
    image = images[0]
    final = ("final",)

    def again(renderer: vkbloom.Renderer, _: int) -> vkbloom.Frames:
        return renderer.apply(image, SETTINGS, attachments=final)

    def composite(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(intensity=0.5 + 0.001 * turn)
        return renderer.apply(image, settings, attachments=final)

    def blur(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(blur_strength=0.5 + 0.001 * turn)
        return renderer.apply(image, settings, attachments=final)

    def everything(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        return renderer.apply(images[turn % COUNT], SETTINGS, attachments=final)

    def all_read(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        return renderer.apply(images[turn % COUNT], SETTINGS)

    def loops(renderer: vkbloom.Renderer, turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(loops=LOOPS)
        return renderer.apply(images[turn % COUNT], settings, attachments=final)

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
    """Add the table of what calls spend, and where."""
    watch = _Stopwatch(renderer._core)
    renderer._core = watch  # type: ignore[assignment]
    whole: dict[str, Times] = {}
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

        # Not in turn: what a case has to do depends on the call before.
        whole[name] = alternate_seconds({name: once}, rounds, warm_up=3)[name]
        inside[name] = Times(tuple(core_seconds[3:]))
    section.times["calls"] = whole
    section.times["calls, in the core"] = inside
    is_gpu = renderer.info.type != "cpu"
    rows = tuple(
        (
            name,
            str(passes[name]),
            f"{1e6 * whole[name].median:.0f}",
            f"{1e6 * inside[name].median:.0f}",
            f"{1e6 * (whole[name].median - inside[name].median):.0f}",
            *([f"{1e6 * device[name]:.0f}"] if is_gpu else []),
        )
        for name in whole
    )
    header = ["", "passes", "call, us", "in the core, us", "in Python, us"]
    if is_gpu:
        header.append("on the device, us")
    section.tables.append(Table("Where a call spends its time", tuple(header), rows))
    section.about.append(_reading(whole, passes, list(whole)))


def _reading(whole: dict[str, Times], passes: dict[str, int], names: list[str]) -> str:
    nothing, _, _, another, all_read, loops = names
    a_pass = (whole[loops].median - whole[another].median) / max(1, passes[loops] - passes[another])
    return (
        f"A call in which nothing runs costs {1e6 * whole[nothing].median:.0f} us (checks, "
        "comparison of the image, submit, readback), each pass of this size "
        f"{1e6 * a_pass:.0f} us more (record and run: {LOOPS} loops against one), and reading "
        "all framebuffers back in place of `final` "
        f"{1e6 * (whole[all_read].median - whole[another].median):.0f} us."
    )
