"""A law of the border: a light there blooms as one far from it, cut off by the frame."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from vkbloom.testing._deviations import Findings, Measured, fail, figure, judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._point_spread import border_share, check_inside, sum_error
from vkbloom.testing._probe import Bloom, Error, Image, Probe, beside_multiple
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# The share of its energy that a line in the outermost column has in the frame.
_LINE: Final = 0.5
# Side of the light, and the period of a chain of four halvings, in pixels.
_LIGHT: Final = 3
_PERIOD: Final = 16
# The largest share of the light in the outermost pixels with which the bloom of a light in the
# middle counts as complete.
_MAX_OUTER_SHARE: Final = 0.01


@dataclasses.dataclass(frozen=True)
class _Lights:
    """The blooms of rectangles, each made once; `dark` is that of a black image."""

    bloom: Bloom
    probe: Probe
    dark: Image
    made: dict[Any, tuple[Image, Error]] = dataclasses.field(default_factory=dict)

    @property
    def side(self) -> int:
        """The side of a light in pixels."""
        return max(_LIGHT, self.probe.light_side)

    def spread(
        self, corner: tuple[int, int], sides: tuple[int, int] | None = None
    ) -> tuple[Image, Error]:
        """Return the bloom of a rectangle from a pixel on, less that of black, and its error."""
        sides = sides or (self.side, self.side)
        if (corner, sides) not in self.made:
            image = self.probe.point(corner, self.probe.value, sides)
            lit, error = self.probe.apply(self.bloom, image)
            self.made[corner, sides] = lit - self.dark, 2 * error
        return self.made[corner, sides]

    def energy(
        self, corner: tuple[int, int], sides: tuple[int, int] | None = None
    ) -> tuple[float, float]:
        """Return the sum of the same, and its error where values have few levels."""
        spread, error = self.spread(corner, sides)
        lit = 0.0 if self.probe.levels is None else sum_error(spread, error)[0] * spread.shape[2]
        return float(spread.sum()), lit


def _test_border(subject: Subject, limits: Limits) -> None:
    """Compare lights near the border and in the outermost pixels with one in the middle.

    With the bloom h of a square of 3 x 3 pixels in the middle, and E the sum of such a bloom: 1.5
    standard deviations of h from an edge, the bloom is h, cut off by the frame. At the border, E is
    at least the part of h that is in the frame. A line in the last column has half of its energy,
    the last pixel of an image with odd sides a quarter. The bloom of a black image is as dark at
    the border as in the middle, and does not show the image before. Where light reaches the border
    from the middle, only energies are tested. What a flat image loses at the border is left to the
    law `gain`.
    """
    bloom, probe, dark = subject.bloom, subject.lamp, subject.dark[0]
    law = "a light at the border has the bloom of a light far from it, cut off by the frame"
    _check_stale(bloom, probe, dark, limits["stale"])
    lights = _Lights(bloom, probe, dark)
    share = border_share(_expect(lights, probe.centre)[0])
    complete = share <= _MAX_OUTER_SHARE
    findings = Findings(law, probe)
    if complete:
        findings.add(_near_the_border(lights, limits))
    findings.add(_at_the_border(lights, limits, complete=complete))
    findings.add([_black(dark, probe, limits["dark"])])
    inner = _expect(lights, probe.centre)[1] / lights.side**2
    findings.add(_last_column(lights, inner, limits["column"]))
    last = subject.last_pixel
    findings.add([last.measure(inner / probe.colours / probe.value, limits["last"])])
    if not findings.broken:
        check_inside(share, probe.size, _MAX_OUTER_SHARE)
    findings.conclude()


def _black(dark: Image, probe: Probe, allowed: float) -> Measured:
    """Measure the outermost pixels of the bloom of a black image."""
    x, y = probe.centre
    ring = np.concatenate([dark[0], dark[-1], dark[:, 0], dark[:, -1]]).mean(axis=1)
    glow = float(np.abs(ring - dark[y, x].mean()).max()) / probe.value
    text = f"a black image has {glow:.3g} of the light of a flat one at its border"
    return "dark", glow, allowed, text


def _near_the_border(lights: _Lights, limits: Limits) -> Iterator[Measured]:
    """Measure how lights 1.5 standard deviations from an edge differ from one in the middle."""
    for name, at in _near(lights).items():
        spread, error = lights.spread(at)
        expected, energy = _expect(lights, at)
        excess = np.abs(spread - expected) / energy
        excess[excess <= (error + _expected_error(lights, at)) / energy] = 0
        profile = excess.sum(axis=(1 - int(name == "left"), 2))
        # Light that comes round is at the far edge; light that is spread too far is nearer.
        quarter = len(profile) // 4
        wrapped = profile[-quarter:].sum() - profile[-2 * quarter : -quarter].sum()
        for kind, share, where in (
            ("wrap", max(0.0, float(wrapped)), "at the opposite side"),
            ("inside", float(profile.sum()), "where the middle has none"),
        ):
            text = f"{100 * share:.3g} % of the light of a square near the {name} edge is {where}"
            yield kind, share, limits[kind], text


def _at_the_border(lights: _Lights, limits: Limits, *, complete: bool) -> Iterator[Measured]:
    """Measure lights in the outermost pixels."""
    x, y = lights.probe.centre
    for name, at in {"left": (0, y), "top": (x, 0), "corner": (0, 0)}.items():
        expected, energy = _expect(lights, at)
        light, error = lights.energy(at)
        share, error = light / energy, 2 * error / energy
        inside = float(expected.sum()) / energy
        kind = "corner" if name == "corner" else "edge"
        figure(f"energy_{name}", share)
        if complete:
            text = f"a light at the {name} has {share:.3g} of its energy, {inside:.3g} is in the "
            yield "lost", max(0.0, inside - share), limits["lost"], f"{text}frame", error
        text = f"a light at the {name} swells to {share:.3g} times its energy"
        yield kind, share, limits[kind], text, error


def _last_column(lights: _Lights, inner: float, allowed: float) -> Iterator[Measured]:
    """Measure a line in the last column; `inner` is the light of a pixel in the middle."""
    x, (width, height) = lights.probe.centre[0], lights.probe.size
    line, (light, error) = (1, height), lights.energy((width - 1, 0), (1, height))
    middle = inner * height
    # Of a linear bloom. A line in the middle decides only if the outermost one has too little.
    if light < middle * _LINE:
        middle = lights.energy((_PERIOD * round(x / _PERIOD), 0), line)[0]
    if middle > 0:
        share = light / middle
        text = f"a line in the outermost column has {share:.3g} of the energy of one in the middle"
        yield "column", max(0.0, _LINE - share), allowed, text, 2 * error / middle


def _check_stale(bloom: Bloom, probe: Probe, dark: Image, allowed: float) -> None:
    """Raise AssertionError if the bloom of a black image is another one after bright images."""
    width, height = (beside_multiple(min(side, 144)) + 3 for side in probe.size)
    smaller = dataclasses.replace(
        probe, size=(min(width, probe.size[0]), min(height, probe.size[1]))
    )
    law = "the bloom of an image does not depend on the image before"
    for name, used in ((", larger", smaller), ("", probe)):
        probe.apply(bloom, probe.flat(probe.value))
        after = used.apply(bloom, used.flat(0.0))[0]
        rise = np.abs(after) - float(np.abs(dark).max()) if name else np.abs(after - dark)
        off = float(rise.max()) / probe.value
        y, x, _ = np.unravel_index(int(rise.argmax()), rise.shape)
        text = f"after a bright{name} image, a black one has {off:.3g} of its light at x {x}, y {y}"
        judge(law, ("stale", off, allowed, text))


def _near(lights: _Lights) -> dict[str, tuple[int, int]]:
    """Return places 1.5 standard deviations from an edge, at most a quarter of a side."""
    probe = lights.probe
    spread, energy = _expect(lights, probe.centre)
    near: list[int] = []
    for axis, side in enumerate(probe.size):
        profile = np.abs(spread.mean(axis=2)).sum(axis=axis)
        variance = profile @ (np.arange(side) - probe.centre[axis] - lights.side // 2) ** 2
        deviation = math.sqrt(float(variance / profile.sum())) if energy > 0 else 0.0
        near.append(min(max(math.ceil(1.5 * deviation) - lights.side // 2, 1), side // 4))
    return {"left": (near[0], probe.centre[1]), "top": (probe.centre[0], near[1])}


def _expect(lights: _Lights, at: tuple[int, int]) -> tuple[Image, float]:
    """Return the bloom of a light near the middle, moved to another place, and its energy."""
    start = _start(lights, at)
    spread = lights.spread(start)[0]
    energy = float(spread.sum())
    if not energy > 0:
        fail("the bloom of a lit pixel is not black", f"its energy is {energy:.3g}")
    return _move(spread, start, at), energy


def _expected_error(lights: _Lights, at: tuple[int, int]) -> Error:
    """Return the errors of the values of `_expect`."""
    start = _start(lights, at)
    error = lights.spread(start)[1]
    return error if np.ndim(error) == 0 else _move(np.asarray(error), start, at)


def _start(lights: _Lights, at: tuple[int, int]) -> tuple[int, int]:
    """Return a place near the middle, a multiple of 16 pixels away.

    A chain of halved images spreads each position of a period differently.
    """
    x, y = (
        position + _PERIOD * round((middle - position) / _PERIOD)
        for position, middle in zip(at, lights.probe.centre, strict=True)
    )
    return x, y


def _move(spread: Image, start: tuple[int, int], to: tuple[int, int]) -> Image:
    """Return an image moved by whole pixels, with black where it has none."""
    x, y = np.subtract(to, start)
    moved = np.roll(spread, (y, x), (0, 1))
    for lines, by in ((moved, y), (moved.swapaxes(0, 1), x)):
        lines[slice(by, None) if by < 0 else slice(by)] = 0
    return moved


#: Where the outermost pixels are repeated, a light in them counts for what is beyond them, too: a
#: Gaussian of 8 pixels reaches 1.6 at an edge and 2.7 in a corner.
BORDER: Final = Law(
    name="border",
    test=_test_border,
    formula="a light at the border has the bloom of a light far from it, cut off by the frame, and "
    "no pixel of it is lost, also where sizes are odd",
    figures={
        "stale": Figure("light of a black image after a bright one", 1e-3),
        "wrap": Figure("light of a square near an edge that is at the opposite edge", 0.01),
        "inside": Figure("light of a square near an edge that is elsewhere", 0.015),
        "energy_left": Figure("light of a square at the left edge, beside the middle"),
        "energy_top": Figure("the same at the top edge"),
        "energy_corner": Figure("the same in a corner"),
        "edge": Figure("the largest of both edges", 2.0),
        "corner": Figure("the same in a corner", 3.0),
        "lost": Figure("light of a square at the border that is in the frame and lost", 0.05),
        "dark": Figure("light of a black image at the border", 0.1),
        "column": Figure("what a line in the last column lacks of half its light", 0.25),
        "last": Figure("what the last pixel of an odd size lacks of a quarter of it", 0.22),
    },
    why="Where the outermost pixels are repeated, a light in them counts for what is beyond them, "
    "too: in the smallest level of a chain that is most of the picture.",
)
