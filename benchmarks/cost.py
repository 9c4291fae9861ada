"""Cost against the number of pixels, the length of the kernel and the number of levels.

float16 RGBA, another image in each round. CPU adapters: wall-clock time, NumPy in and out. GPUs:
time of the passes on the device; OpenCV always has wall-clock time. The lines are least-squares
fits of relative deviations. A positive deviation is slower than the line.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.image import SETTINGS, full_kernel
from benchmarks.inputs import COUNT, THRESHOLD, pictures
from benchmarks.ours import contender
from benchmarks.plan import Plan
from benchmarks.results import Section, Table
from benchmarks.timing import Contender, Times, alternate

__all__ = ["Line", "run"]

SIDES: Final = (64, 128, 256, 512, 1024, 2048, 4096)
#: The line is fitted from this side on.
FIRST_SIDE: Final = 512
RADII: Final = (1, 2, 4, 8, 16, 32, 64)
#: For 1024 pixels a side. A further level would be 1 x 1, which is left out.
LEVELS: Final = tuple(range(1, 10))
SIDE: Final = 1024
SMALL: Final = 256
SEPARABLE: Final = "vkbloom, 9 taps"
FRAGMENT: Final = "vkbloom, 9 taps, fragment variant"
OURS: Final = "vkbloom, Separable"
PYRAMID: Final = "vkbloom, Pyramid(levels=5)"


@dataclass(frozen=True)
class Line:
    """A straight line ``y = start + slope x`` with the same relative weight for every point."""

    start: float
    slope: float

    @classmethod
    def through(cls, x: Sequence[float], y: Sequence[float]) -> Line:
        """Fit the line whose relative deviations have the least sum of squares."""
        weight = 1 / np.asarray(y, float)
        terms = np.stack([weight, np.asarray(x, float) * weight], axis=1)
        (start, slope), *_ = np.linalg.lstsq(terms, np.ones(len(weight)), rcond=None)
        return cls(float(start), float(slope))

    def deviation(self, x: float, y: float) -> float:
        """Return how far a point is above the line, relative to the line's value there."""
        return y / (self.start + self.slope * x) - 1


def run(plan: Plan, section: Section) -> None:
    """Time vkbloom and OpenCV over sizes and kernels, and vkbloom over levels."""
    section.title = "Cost against pixels, kernel length and levels"
    with ExitStack() as stack:
        ours, source = (
            stack.enter_context(plan.renderer(variant)) for variant in ("auto", "fragment")
        )
        _over_pixels(plan, section, ours, source)
        _over_taps(plan, section, ours)
        _over_levels(plan, section, ours)


def _peer_contenders(
    plan: Plan, section: Section, images: list[NDArray[Any]], kernel: NDArray[np.float32], name: str
) -> list[Contender]:
    made: dict[str, peers.ImageBloom] = peers.gather(
        ("OpenCV",),
        lambda peer: peer.image_bloom(images[0], kernel, THRESHOLD, plan.threads),
        section.missing,
    )
    bloom = made.get("OpenCV")
    return [] if bloom is None else [Contender(name, lambda turn: bloom(images[turn % COUNT]))]


def _over_pixels(
    plan: Plan, section: Section, ours: vkbloom.Renderer, source: vkbloom.Renderer
) -> None:
    sides = SIDES[:3] if plan.quick else SIDES
    found: dict[str, list[Times]] = {}
    for side in sides:
        plan.tell(f"cost: {side} x {side}")
        images = pictures((side, side), np.float16)
        feed = itertools.cycle(images)
        contenders = [
            contender(SEPARABLE, ours, feed, SETTINGS),
            contender(FRAGMENT, source, itertools.cycle(images), SETTINGS),
            contender(PYRAMID, ours, feed, vkbloom.Pyramid(levels=5, threshold=THRESHOLD)),
            *_peer_contenders(plan, section, images, full_kernel(SETTINGS), "OpenCV, 9 taps"),
        ]
        times = alternate(contenders, plan.times(25 if side < 1024 else 9))
        section.add_times(
            f"{side} x {side}", times, {each.name: each.clock for each in contenders}, SEPARABLE
        )
        for name, measured in times.items():
            found.setdefault(name, []).append(measured)
    axis = CostAxis(
        "pixels",
        tuple(f"{side} x {side}" for side in sides),
        tuple(float(side * side) for side in sides),
        0 if plan.quick else sides.index(FIRST_SIDE),
        "ns a pixel",
        1e9,
    )
    for name, each in found.items():
        _add(section, axis, name, each)


def _over_taps(plan: Plan, section: Section, ours: vkbloom.Renderer) -> None:
    side = SMALL if plan.quick else SIDE
    images = pictures((side, side), np.float16)
    radii = RADII[:3] if plan.quick else RADII
    found: dict[str, list[Times]] = {}
    for radius in radii:
        plan.tell(f"cost: {2 * radius + 1} taps")
        weights = vkbloom.gaussian_weights(max(radius / 2, 0.5), radius)
        settings = SETTINGS.replace(weights=weights, blur_strength=1.0)
        contenders = [
            contender(OURS, ours, itertools.cycle(images), settings),
            *_peer_contenders(plan, section, images, full_kernel(settings), "OpenCV, sepFilter2D"),
        ]
        times = alternate(contenders, plan.times(9))
        section.add_times(
            f"{2 * radius + 1} taps", times, {each.name: each.clock for each in contenders}, OURS
        )
        for name, measured in times.items():
            found.setdefault(name, []).append(measured)
    taps = tuple(2 * radius + 1 for radius in radii)
    axis = CostAxis(
        "taps",
        tuple(map(str, taps)),
        tuple(map(float, taps)),
        0,
        "ns a tap and pixel",
        1e9 / side**2,
    )
    for name, each in found.items():
        _add(section, axis, f"{name}, {side} x {side}", each)


def _over_levels(plan: Plan, section: Section, ours: vkbloom.Renderer) -> None:
    side = SMALL if plan.quick else SIDE
    images = itertools.cycle(pictures((side, side), np.float16))
    levels = LEVELS[:3] if plan.quick else LEVELS
    plan.tell("cost: levels")
    settings = {count: vkbloom.Pyramid(levels=count, threshold=THRESHOLD) for count in levels}
    contenders = [contender(str(count), ours, images, each) for count, each in settings.items()]
    times = alternate(
        contenders,
        plan.times(9),
    )
    section.add_times("levels", times, {each.name: each.clock for each in contenders}, "")
    # The first two levels hold nearly all pixels. Each further level costs only its passes.
    first = min(2, len(levels) - 2)
    axis = CostAxis(
        "levels", tuple(map(str, levels)), tuple(map(float, levels)), first, "us a level", 1e6
    )
    _add(section, axis, f"vkbloom, Pyramid, {side} x {side}", list(times.values()))


@dataclass(frozen=True)
class CostAxis:
    """The x axis of a cost, the first row of its fitted line, and the unit of the slope."""

    chart: str
    labels: tuple[str, ...]
    x: tuple[float, ...]
    first: int
    unit: str
    scale: float


def _add(section: Section, axis: CostAxis, name: str, measured: list[Times]) -> None:
    """Add the table and the curve of one contender."""
    medians = [times.median for times in measured]
    line = Line.through(axis.x[axis.first :], medians[axis.first :])
    rows = []
    for index, (label, place) in enumerate(zip(axis.labels, axis.x, strict=True)):
        times = measured[index]
        off = f"{100 * line.deviation(place, times.median):+.1f} %" if index >= axis.first else ""
        share = f"{axis.scale * times.median / place:.3g}"
        rows.append((label, f"{1e3 * times.median:.3f}", f"{1e3 * times.least:.3f}", share, off))
    caption = (
        f"{name}, against {axis.chart}: line from {axis.labels[axis.first]} on, "
        f"{1e3 * line.start:.3g} ms + {axis.scale * line.slope:.3g} {axis.unit}"
    )
    header = (axis.chart, "median, ms", "least, ms", f"{axis.unit}, start included", "off the line")
    section.tables.append(Table(caption, header, tuple(rows)))
