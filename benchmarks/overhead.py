"""The constant cost of a call, and what passes and readback add to it.

The image is so small that the constant cost of the call dominates. NumPy in and out; wall-clock
time. The control is a second renderer of the same kind: its difference is noise.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks.image import SETTINGS
from benchmarks.inputs import COUNT, pictures
from benchmarks.ours import OURS, applied, contest, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section, Table
from benchmarks.timing import Contender, alternate

__all__ = ["run"]

SIZE: Final = (64, 64)
ROUNDS: Final = 101
LOOPS: Final = 8
FRAGMENT: Final = "vkbloom, plain fragment variant"
AGAIN: Final = "vkbloom once more, a control"


def run(plan: Plan, section: Section) -> None:
    """Time calls on 64 x 64 pixels, against the fragment variant and by the work they do."""
    section.title = f"A call on {SIZE[0]} x {SIZE[1]}, float16 RGBA"
    images = pictures(SIZE, np.float16)
    with ExitStack() as stack:
        made = {
            name: stack.enter_context(plan.renderer(variant))
            for name, variant in ((OURS, "auto"), (FRAGMENT, "fragment"), (AGAIN, "auto"))
        }
        contenders = [Contender(name, applied(one, images, SETTINGS)) for name, one in made.items()]
        caption = "Another image in each call"
        times = contest(plan, section, "variants", contenders, ROUNDS, caption=caption, warm_up=5)
        # The two should be equal; medians of equal work differ by up to 5 %.
        ratios(section, "64 x 64", times, (OURS, FRAGMENT, 1.05, True))
        _by_work(section, made[OURS], images, plan.times(ROUNDS))


def _by_work(
    section: Section, renderer: vkbloom.Renderer, images: list[NDArray[Any]], rounds: int
) -> None:
    """Add the table of calls that cause different work."""

    def call(name: str = "final", *, new: bool = False, **fields: Callable[[int], float]) -> Any:
        """Return a call; `new`: each has another image; `fields`: functions of the turn."""

        def once(turn: int) -> vkbloom.Frames:
            settings = SETTINGS.replace(**{key: value(turn) for key, value in fields.items()})
            return renderer.apply(
                images[turn % COUNT if new else 0],
                settings,
                framebuffers=name,
            )

        return once

    calls = {
        "nothing runs: same image, same settings": call(),
        "other intensity": call(intensity=lambda turn: 0.5 + 0.001 * turn),
        "other blur_strength": call(blur_strength=lambda turn: 0.5 + 0.001 * turn),
        "another image": call(new=True),
        "another image, all framebuffers read back": call("all", new=True),
        f"another image, {LOOPS} loops": call(new=True, loops=lambda _: LOOPS),
    }
    # Not in turn: the work of a call depends on the one before.
    times = {
        name: alternate([Contender(name, once)], rounds, warm_up=3)[name]
        for name, once in calls.items()
    }
    section.times["calls"] = times
    rows = []
    for name, once in calls.items():
        once(0)
        passes = once(1).timings
        on_device = f"{1e6 * sum(passes.values()):.0f}" if renderer.info.type != "cpu" else ""
        rows.append((name, str(len(passes)), f"{1e6 * times[name].median:.0f}", on_device))
    header = ("", "passes", "call, us", "on the device, us")
    section.tables.append(Table("What a call costs", header, tuple(rows)))
