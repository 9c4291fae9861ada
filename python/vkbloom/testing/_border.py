"""What a bloom does at the border of the image, and across the seam of two views."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from vkbloom._argument_types import checked
from vkbloom._public import public
from vkbloom.testing._deviations import Findings, Measured, fail, figure, judge
from vkbloom.testing._point_spread import border_share, check_inside, sum_error
from vkbloom.testing._probe import (
    DEFAULT,
    Bloom,
    Error,
    Image,
    NotTaken,
    Probe,
    beside_multiple,
    call,
)
from vkbloom.testing._shape import LastPixel, last_pixel

__tracebackhide__ = True

#: Limits by figure. Where the outermost pixels are repeated, a light in them counts for what is
#: beyond them, too: a Gaussian of 8 pixels reaches 1.6 at an edge and 2.7 in a corner.
BORDER_LIMITS: Final = {
    "stale": 1e-3,
    "wrap": 0.01,
    "inside": 0.015,
    "edge": 2.0,
    "corner": 3.0,
    "lost": 0.05,
    "dark": 0.1,
    "line": 0.25,
    "last": 0.22,
}
# The share of its energy that a line in the outermost column has in the frame.
_LINE: Final = 0.5
# Side of the light, and the period of a chain of four halvings, in pixels.
_LIGHT: Final = 3
_PERIOD: Final = 16
# The largest share of the light in the outermost pixels with which the bloom of a light in the
# middle counts as complete.
_OUTERMOST: Final = 0.01


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


@public("vkbloom.testing")
@checked
def assert_border(
    bloom: Bloom, probe: Probe = DEFAULT, *, limits: Mapping[str, float] | None = None
) -> None:
    """Assert that a border neither adds light nor takes it away.

    With the bloom h of a square of 3 x 3 pixels in the middle, and E the sum of such a bloom: 1.5
    standard deviations of h from an edge, the bloom is h, cut off by the frame ("inside" is the
    light that differs, "wrap" that at the opposite edge, as shares of E of the middle). At the
    border, E is at least the part of h that is in the frame, less "lost", and at most "edge" or
    "corner" times E of the middle. A line in the last column has half of its energy, less
    "line". The last pixel of an image with odd sides has a quarter of its energy, less "last". The
    bloom of a black image is as dark at the border as in the middle ("dark"), and does not show the
    image before ("stale"). What a flat image loses at the border is left to `assert_gain`.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width: the bloom alone.
    probe : Probe
        Where light reaches the border from the middle, only energies are tested.
    limits : mapping of str to float, optional
        Limits by figure, in place of those of `BORDER_LIMITS`.
    """
    dark = probe.apply(bloom, probe.flat(0.0))[0]
    check_border(bloom, probe, dark, BORDER_LIMITS | dict(limits or {}))


def check_border(
    bloom: Bloom,
    probe: Probe,
    dark: Image,
    allowed: Mapping[str, float],
    last: LastPixel | None = None,
) -> None:
    """Raise AssertionError if a border matters; `dark` is the bloom of a black image."""
    law = "a light at the border has the bloom of a light far from it, cut off by the frame"
    _check_stale(bloom, probe, dark, allowed["stale"])
    lights = _Lights(bloom, probe, dark)
    share = border_share(_expected(lights, probe.centre)[0])
    complete = share <= _OUTERMOST
    findings = Findings(law, probe)
    if complete:
        findings.add(_near_the_border(lights, allowed))
    findings.add(_at_the_border(lights, allowed, complete=complete))
    findings.add([_black(dark, probe, allowed["dark"])])
    inner = _expected(lights, probe.centre)[1] / lights.side**2
    findings.add(_last_column(lights, inner, allowed["line"]))
    last = last or last_pixel(bloom, probe, is_dark=not dark.any())
    findings.add([last.measured(inner / probe.colours / probe.value, allowed["last"])])
    if not findings.broken:
        check_inside(share, probe.size, _OUTERMOST)
    findings.conclude()


def _black(dark: Image, probe: Probe, allowed: float) -> Measured:
    """Measure the outermost pixels of the bloom of a black image."""
    x, y = probe.centre
    ring = np.concatenate([dark[0], dark[-1], dark[:, 0], dark[:, -1]]).mean(axis=1)
    glow = float(np.abs(ring - dark[y, x].mean()).max()) / probe.value
    text = f"a black image has {glow:.3g} of the light of a flat one at its border"
    return "dark", glow, allowed, text


def _near_the_border(lights: _Lights, allowed: Mapping[str, float]) -> Iterator[Measured]:
    """Measure how lights 1.5 standard deviations from an edge differ from one in the middle."""
    for name, at in _near(lights).items():
        spread, error = lights.spread(at)
        expected, energy = _expected(lights, at)
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
            yield kind, share, allowed[kind], text


def _at_the_border(
    lights: _Lights, allowed: Mapping[str, float], *, complete: bool
) -> Iterator[Measured]:
    """Measure lights in the outermost pixels."""
    x, y = lights.probe.centre
    for name, at in {"left": (0, y), "top": (x, 0), "corner": (0, 0)}.items():
        expected, energy = _expected(lights, at)
        light, error = lights.energy(at)
        share, error = light / energy, 2 * error / energy
        inside = float(expected.sum()) / energy
        kind = "corner" if name == "corner" else "edge"
        figure(f"energy_{name}", share)
        if complete:
            text = f"a light at the {name} has {share:.3g} of its energy, {inside:.3g} is in the "
            yield "lost", max(0.0, inside - share), allowed["lost"], f"{text}frame", error
        text = f"a light at the {name} swells to {share:.3g} times its energy"
        yield kind, share, allowed[kind], text, error


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


@public("vkbloom.testing")
@checked
def assert_views(bloom: Bloom, probe: Probe = DEFAULT, *, limit: float = 1e-3) -> None:
    """Assert that no light crosses from one view of a picture to the other.

    The law: B(a, region=r) inside of r depends on the pixels inside of r alone. The picture has two
    views, side by side and then one above the other, as for the two eyes of a headset. One has
    noise, the other one is black or has noise, too; then the other way round.

    Parameters
    ----------
    bloom : callable
        ``bloom(image, *, region)``; `region` is (x, y, width, height) in pixels. Returns an image
        of the picture's size, or of that of the region.
    probe : Probe
        Its size is that of a view.
    limit : float
        Allowed difference, as a share of the largest value of the bloom, beyond the errors of
        values.
    """
    if not takes(bloom, "region"):
        raise NotTaken("bloom: it takes no keyword region, so views are not told apart")
    noise = [probe.noise(index, probe.value) for index in (0, 1)]
    law = "the bloom of a view depends on the pixels of that view alone"
    for side, name in enumerate(("left", "right", "upper", "lower")):
        axis, second = 1 - side // 2, side % 2
        corner = second * np.array(probe.size) * (axis == 1, axis == 0)
        results = []
        for other in (probe.flat(0.0), noise[1 - second]):
            views = [other, noise[second]] if second else [noise[second], other]
            given = probe.given(np.concatenate(views, axis=axis))
            region = (*map(int, corner), *probe.size)
            result = np.asarray(call(bloom, given, region=region))
            if result.shape[:2] == given.shape[:2]:
                result = np.split(result, 2, axis=axis)[second]
            results.append(probe.values(result, probe.given(noise[second])))
        (alone, error), (beside, _) = results
        off = np.abs(beside - alone)
        largest = float(np.abs(alone).max()) or 1.0
        share = max(0.0, float((off - 2 * error).max())) / largest
        y, x, _ = np.unravel_index(int(off.argmax()), off.shape)
        text = (
            f"the other view changes the {name} one by {share:.3g} of its largest value, most at "
            f"x {x}, y {y}: {limit:g} allowed"
        )
        judge(law, ("crosstalk", share, limit, text))


def takes(bloom: object, name: str) -> bool:
    """Return whether a callable takes a keyword of this name."""
    try:
        parameters = inspect.signature(bloom).parameters.values()  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False
    return any(
        parameter.name == name or parameter.kind is parameter.VAR_KEYWORD
        for parameter in parameters
    )


def _near(lights: _Lights) -> dict[str, tuple[int, int]]:
    """Return places 1.5 standard deviations from an edge, at most a quarter of a side."""
    probe = lights.probe
    spread, energy = _expected(lights, probe.centre)
    near: list[int] = []
    for axis, side in enumerate(probe.size):
        profile = np.abs(spread.mean(axis=2)).sum(axis=axis)
        variance = profile @ (np.arange(side) - probe.centre[axis] - lights.side // 2) ** 2
        deviation = math.sqrt(float(variance / profile.sum())) if energy > 0 else 0.0
        near.append(min(max(math.ceil(1.5 * deviation) - lights.side // 2, 1), side // 4))
    return {"left": (near[0], probe.centre[1]), "top": (probe.centre[0], near[1])}


def _expected(lights: _Lights, at: tuple[int, int]) -> tuple[Image, float]:
    """Return the bloom of a light near the middle, moved to another place, and its energy."""
    start = _start(lights, at)
    spread = lights.spread(start)[0]
    energy = float(spread.sum())
    if not energy > 0:
        fail("the bloom of a lit pixel is not black", f"its energy is {energy:.3g}")
    return _moved(spread, start, at), energy


def _expected_error(lights: _Lights, at: tuple[int, int]) -> Error:
    """Return the errors of the values of `_expected`."""
    start = _start(lights, at)
    error = lights.spread(start)[1]
    return error if np.ndim(error) == 0 else _moved(np.asarray(error), start, at)


def _start(lights: _Lights, at: tuple[int, int]) -> tuple[int, int]:
    """Return a place near the middle, a multiple of 16 pixels away.

    A chain of halved images spreads each position of a period differently.
    """
    x, y = (
        position + _PERIOD * round((middle - position) / _PERIOD)
        for position, middle in zip(at, lights.probe.centre, strict=True)
    )
    return x, y


def _moved(spread: Image, start: tuple[int, int], to: tuple[int, int]) -> Image:
    """Return an image moved by whole pixels, with black where it has none."""
    x, y = np.subtract(to, start)
    moved = np.roll(spread, (y, x), (0, 1))
    for lines, by in ((moved, y), (moved.swapaxes(0, 1), x)):
        lines[slice(by, None) if by < 0 else slice(by)] = 0
    return moved
