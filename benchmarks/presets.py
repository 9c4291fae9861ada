"""Each preset: the variant that the adapter runs, beside the fragment variant.

Half-float RGBA of 1920 x 1080, NumPy in and out, another image in each round. Both make the same
picture, which is compared first. By the wall clock on a CPU, by timestamps of the passes on a GPU.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import OURS, contest, prepare_call
from benchmarks.plan import Plan
from benchmarks.results import Section
from benchmarks.timing import Contender, device_clock

__all__ = ["run"]

SIZE: Final = (1920, 1080)
ROUNDS: Final = 7
#: The pictures of the benchmarks are at most 0.7; most presets have a threshold near 1.
BRIGHTNESS: Final = 4
FRAGMENT: Final = "fragment"


def run(plan: Plan, section: Section) -> None:
    """Time all presets."""
    size = plan.size(*SIZE)
    section.title = f"Presets at {size[0]} x {size[1]}, float16 RGBA"
    images: list[Any] = [BRIGHTNESS * one for one in pictures(size, np.float16)]
    with plan.renderer() as ours, plan.renderer("fragment") as fragment:
        clock = device_clock(ours.info)
        for name, settings in vkbloom.presets.items():
            plan.tell(f"presets: {name}")
            # The call before them has the image of turn -1.
            calls = [prepare_call(one, images, settings) for one in (ours, fragment)]
            expected, made = (call(-1)["final"] for call in calls)
            contest(
                plan,
                section,
                name,
                [Contender(OURS, calls[0], clock), Contender(FRAGMENT, calls[1], clock)],
                ROUNDS,
                pictures=[(FRAGMENT, expected, made)],
                warm_up=1,
            )
