"""Each preset with and without each variant of its passes.

Half-float RGBA of 1920 x 1080, NumPy in and out, another image in each round. Without a variant the
next row of the table in `csrc/variants/variants.c` runs that can, at last the method's own pass
(VKBLOOM_VARIANT=cpu-filtered). The pictures are compared first. By the wall clock on a CPU, by
timestamps of the passes on a GPU.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any, Final

import numpy as np

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import prepare_call
from benchmarks.plan import Plan
from benchmarks.presets import BRIGHTNESS
from benchmarks.results import Section, equality, side_by_side
from benchmarks.timing import Contender, alternate, device_clock

__all__ = ["run"]

SIZE: Final = (1920, 1080)
ROUNDS: Final = 7
#: A pass that is drawn or dispatched as its method defines it.
METHODS_OWN: Final = {"fragment", "dispatch"}
WITH: Final = "with"
WITHOUT: Final = "without"


def run(plan: Plan, section: Section) -> None:
    """Time all presets, each with the variants that its plan has."""
    size = plan.size(*SIZE)
    section.title = f"Variants at {size[0]} x {size[1]}, float16 RGBA"
    images: list[Any] = [BRIGHTNESS * one for one in pictures(size, np.float16)]
    with ExitStack() as stack:
        ours = stack.enter_context(plan.renderer())
        clock = device_clock(ours.info)
        renderers: dict[str, vkbloom.Renderer] = {}
        for preset, settings in vkbloom.presets.items():
            plan.tell(f"variants: {preset}")
            passes = ours.plan(images[0], settings, framebuffers=("final",)).passes
            names = sorted({one.variant for one in passes} - METHODS_OWN)
            for name in names:
                if name not in renderers:
                    renderers[name] = stack.enter_context(plan.renderer(f"auto-{name}"))
            calls = {WITH: prepare_call(ours, images, settings)}
            calls |= {name: prepare_call(renderers[name], images, settings) for name in names}
            # The call before the first round has the image of turn -1.
            expected = calls[WITH](-1)["final"]
            for name in names:
                what = f"{preset} without {name}"
                section.agreements.append(equality(what, expected, calls[name](-1)["final"]))
                if not section.agreements[-1].agrees:
                    del calls[name]
            contenders = [Contender(name, call, clock) for name, call in calls.items()]
            times = alternate(contenders, plan.times(ROUNDS), warm_up=1)
            for name in names:
                if name not in times:
                    continue
                pair = {WITH: times[WITH], WITHOUT: times[name]}
                group = f"{preset}, {name}"
                section.add_times(group, pair, contenders[0].clock, WITH)
                section.tables.append(side_by_side(group, pair, WITH))
