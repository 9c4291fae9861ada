"""Many requests with one image, in the best order, against single calls.

Settings over blur_scale x blur_strength x intensity for one image. `final` of each request becomes
an array; wall-clock time. Best order: intensity changes fastest, then blur_strength. Worst order:
blur_scale changes fastest, so that no request can use the blur of the one before. Contenders take
turns in blocks of requests.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterable
from contextlib import ExitStack
from typing import Final

import numpy as np

import vkbloom
from benchmarks.inputs import THRESHOLD, picture
from benchmarks.plan import Plan
from benchmarks.results import Section, Table, agreement
from benchmarks.timing import Times

__all__ = ["best_order", "run", "worst_order"]

SIZE: Final = (256, 256)
BLOCKS: Final = 20
MANY: Final = "sweep, best order"
CALLS: Final = "apply, best order"
WORST: Final = "apply, worst order"


def best_order(count: int) -> list[vkbloom.Separable]:
    """Return settings over blur_scale x blur_strength x intensity, the last changing fastest.

    So most requests need only the composite, and some the blur, too. The lengths of the axes are as
    1 : 2 : 5, which is 10 x 20 x 50 for 10,000 requests. With other counts the last ones are left
    out.
    """
    side = 1
    while 10 * side**3 < count:
        side += 1
    scales = np.linspace(1.0, 3.0, side)
    strengths = np.linspace(0.5, 2.0, 2 * side)
    intensities = np.linspace(0.1, 1.5, 5 * side)
    grid = itertools.product(scales, strengths, intensities)
    return [
        vkbloom.Separable(
            threshold=THRESHOLD, blur_scale=scale, blur_strength=strength, intensity=intensity
        )
        for scale, strength, intensity in itertools.islice(grid, count)
    ]


def worst_order(settings: Iterable[vkbloom.Separable]) -> list[vkbloom.Separable]:
    """Return the same settings with blur_scale changing fastest: every request blurs again."""
    return sorted(settings, key=lambda each: (each.intensity, each.blur_strength))


def run(plan: Plan, section: Section) -> None:
    """Time `plan.requests` requests with one half-float image, in blocks that alternate."""
    count = min(plan.requests, 60) if plan.quick else plan.requests
    section.title = f"{count:,} requests of {SIZE[0]} x {SIZE[1]}, float16 RGBA"
    image = picture(SIZE, np.float16, 4, 0)
    settings = best_order(count)
    work = {MANY: settings, CALLS: settings, WORST: worst_order(settings)}
    block = -(-count // BLOCKS)
    seconds: dict[str, list[float]] = {name: [] for name in work}
    passes = dict.fromkeys(work, 0)
    with ExitStack() as stack:
        renderers = {name: stack.enter_context(plan.renderer()) for name in work}
        first = renderers[MANY].apply(image, settings[0])
        everything = count * len(first.timings)
        for name, renderer in renderers.items():
            alone = renderer.apply(image, work[name][0], framebuffers=("final",))["final"]
            many = next(renderers[MANY].sweep(image, work[name][:1], framebuffers=("final",)))[
                "final"
            ]
            section.agreements.append(agreement(name, many, alone, 0.0, "the same computation"))
        for start in range(0, count, block):
            for name, renderer in renderers.items():
                part = work[name][start : start + block]
                duration, ran = _time_block(renderer, image, part, many=name == MANY)
                seconds[name].append(duration)
                passes[name] += ran
    times = {name: Times(tuple(durations)) for name, durations in seconds.items()}
    section.add_times("blocks of requests", times, ours=MANY)
    rows = []
    for name, measured in times.items():
        total = sum(measured.seconds)
        rows.append(
            (
                name,
                f"{total:.2f}",
                f"{1e3 * total / count:.3f}",
                f"{passes[name]:,} of {everything:,}",
                str(measured.over(times[MANY])),
            )
        )
    header = ("", "all, s", "ms a request", "passes run", f"times as long as {MANY} (interval)")
    section.tables.append(Table("", header, tuple(rows)))


def _time_block(
    renderer: vkbloom.Renderer,
    image: np.ndarray[tuple[int, ...], np.dtype[np.generic]],
    settings: list[vkbloom.Separable],
    *,
    many: bool,
) -> tuple[float, int]:
    """Return the seconds that the requests take, and the number of passes that ran."""
    ran = 0
    start = time.perf_counter()
    if many:
        for frames in renderer.sweep(image, settings, framebuffers=("final",)):
            ran += len(frames.timings)
    else:
        for each in settings:
            ran += len(renderer.apply(image, each, framebuffers=("final",)).timings)
    return time.perf_counter() - start, ran
