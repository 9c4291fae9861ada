"""The time that bloom adds to a forward frame: frames with it minus frames without it.

The built-in scene at another time in each round, so that every pass runs. `final` is read back;
wall-clock time. The cost of bloom is the difference between a frame with bloom and the frame of the
same round without bloom, which has no glow mesh either.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Final

import vkbloom
from benchmarks.ours import contest
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, Table
from benchmarks.timing import Contender

__all__ = ["run"]

SIZE: Final = (1280, 720)
ROUNDS: Final = 25
NAMES: Final = {"auto": "vkbloom", "fragment": "the source's variant"}


def run(plan: Plan, section: Section) -> None:
    """Time frames of the built-in scene with all defaults, bloom on and off."""
    size = plan.size(*SIZE)
    section.title = f"A forward frame at {size[0]} x {size[1]}, all defaults"
    scene = vkbloom.Scene.ufo()
    with ExitStack() as stack:
        # One renderer each: a renderer that has drawn the scene with bloom would not draw it again
        # without bloom.
        renderers = {
            (variant, bloom): stack.enter_context(plan.renderer(variant))
            for variant in NAMES
            for bloom in (True, False)
        }

        def frame(variant: str, turn: int, *, bloom: bool) -> vkbloom.Frames:
            return renderers[variant, bloom].render(
                scene,
                vkbloom.Separable(bloom=bloom),
                size,
                time=0.013 * turn,
                framebuffers=("final",),
            )

        made = [
            (
                f"both variants at time {0.013 * turn:g}",
                frame("auto", turn, bloom=True)["final"],
                frame("fragment", turn, bloom=True)["final"],
            )
            for turn in (0, 20, 50)
        ]
        contenders = [
            Contender(
                f"{name}, bloom {'on' if bloom else 'off'}",
                lambda turn, variant=variant, bloom=bloom: frame(variant, turn, bloom=bloom),  # type: ignore[misc]
            )
            for variant, name in NAMES.items()
            for bloom in (True, False)
        ]
        times = contest(
            plan,
            section,
            "frames",
            contenders,
            ROUNDS,
            pictures=made,
            allowed=(1.0, "one level of 8 bits"),
            ours=f"{NAMES['auto']}, bloom on",
        )
    extra = {
        name: times[f"{name}, bloom on"].minus(times[f"{name}, bloom off"])
        for name in NAMES.values()
    }
    section.add_times("bloom alone", extra, ours=NAMES["auto"])
    rows = []
    for name, each in extra.items():
        _, low, high = each.estimate()
        rows.append((name, f"{1e3 * each.median:.2f}", f"{1e3 * low:.2f} to {1e3 * high:.2f}"))
    section.tables.append(
        Table("Bloom alone", ("", "median of the differences, ms", "interval"), tuple(rows))
    )
    ratio = extra[NAMES["auto"]].over(extra[NAMES["fragment"]])
    if all(found.agrees for found in section.agreements):
        what = "forward frame: bloom's cost / that of the source's variant"
        section.goals.append(Goal(what, ratio, 1 / 3, at_most=True))
