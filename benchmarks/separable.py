"""The gain of separability: the same blur as two passes and as one N x N pass.

The same Gaussian as two passes of N taps and as one pass of N x N (`direct=True`). The time of a
kernel of one tap is subtracted: upload, readback, composite, and the cost of a pass without taps.
CPU adapters: wall-clock time. GPUs: time of the passes on the device.
"""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import contender
from benchmarks.plan import Plan
from benchmarks.results import Section, Table, agreement
from benchmarks.timing import alternate

__all__ = ["run"]

SIZE: Final = (640, 360)
RADII: Final = (1, 2, 4, 8, 16)
ROUNDS: Final = 7
NOTHING: Final = "one tap"


def run(plan: Plan, section: Section) -> None:
    """Time two passes of N taps and one of N x N, for several N."""
    size = plan.size(*SIZE)
    section.title = f"Two passes against one at {size[0]} x {size[1]}, float32 RGBA"
    images = pictures(size, np.float32)
    rows = []
    with plan.renderer() as renderer:
        feed = itertools.cycle(images)
        for radius in RADII[:2] if plan.quick else RADII:
            taps = 2 * radius + 1
            plan.tell(f"separable: {taps} taps")
            two = vkbloom.Separable(weights=vkbloom.gaussian_weights(radius / 2, radius))
            one = two.replace(direct=True)
            first, second = (renderer.apply(images[0], each)["bloom"] for each in (two, one))
            what = f"{taps} taps: two passes and one"
            reason = "rgba32float between the passes; other order of the sums"
            section.agreements.append(agreement(what, first, second, 1e-4, reason))
            times = alternate(
                [
                    contender(NOTHING, renderer, feed, two.replace(weights=(1.0,))),
                    contender("two passes", renderer, feed, two),
                    contender("one pass", renderer, feed, one),
                ],
                plan.times(ROUNDS),
            )
            section.times[f"{taps} taps"] = times
            nothing = times[NOTHING].median
            passes = [times[name].median - nothing for name in ("two passes", "one pass")]
            ratio = f"{passes[1] / passes[0]:.1f}" if min(passes) > 0 else "too close to one tap"
            milliseconds = (f"{1e3 * seconds:.2f}" for seconds in (nothing, *passes))
            rows.append((str(taps), *milliseconds, ratio, f"{taps / 2:.1f}"))
    header = (
        "taps a line",
        "subtracted, ms",
        "two passes, ms",
        "one pass, ms",
        "one / two",
        "ratio of taps",
    )
    section.tables.append(Table("", header, tuple(rows)))
