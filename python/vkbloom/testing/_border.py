"""What a bloom does at the border of the image, and across the seam of two views."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from vkbloom._argument_types import checked
from vkbloom.testing._deviations import Measured, NotTaken, breaches, fail, figure, judge
from vkbloom.testing._point_spread import border_share, check_inside
from vkbloom.testing._probe import DEFAULT, Bloom, Image, Probe, beside_multiple

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
    "flat": 0.1,
}
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
    made: dict[Any, tuple[Image, float]] = dataclasses.field(default_factory=dict)

    def spread(
        self, corner: tuple[int, int], sides: tuple[int, int] = (_LIGHT, _LIGHT)
    ) -> tuple[Image, float]:
        """Return the bloom of a rectangle from a pixel on, less that of black, and its error."""
        if (corner, sides) not in self.made:
            image = self.probe.point(corner, self.probe.value, sides)
            lit, error = self.probe.apply(self.bloom, image)
            self.made[corner, sides] = lit - self.dark, 2 * error
        return self.made[corner, sides]


@checked
def assert_border(
    bloom: Bloom, probe: Probe = DEFAULT, *, limits: Mapping[str, float] | None = None
) -> None:
    """Assert that a border neither adds light nor takes it away.

    With the bloom h of a square of 3 x 3 pixels in the middle, and E the sum of such a bloom: 1.5
    standard deviations of h from an edge, the bloom is h, cut off by the frame ("inside" is the
    light that differs, "wrap" that at the opposite edge, as shares of E of the middle). At the
    border, E is at least the part of h that is in the frame, less "lost", and at most "edge" or
    "corner" times E of the middle. The bloom of a flat image is the same at the border as in the
    middle, within "flat". The bloom of a black image does not show the image before ("stale").

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width: the bloom alone.
    probe : Probe
        Where light reaches the border from the middle, only energies and flat images are tested.
    limits : mapping of str to float, optional
        Limits by figure, in place of those of `BORDER_LIMITS`.
    """
    dark = probe.apply(bloom, probe.flat(0.0))[0]
    check_border(bloom, probe, dark, BORDER_LIMITS | dict(limits or {}))


def check_border(bloom: Bloom, probe: Probe, dark: Image, allowed: Mapping[str, float]) -> None:
    """Raise AssertionError if a border matters; `dark` is the bloom of a black image."""
    law = "a light at the border has the bloom of a light far from it, cut off by the frame"
    flat = _check_stale(bloom, probe, dark, allowed["stale"])
    lights = _Lights(bloom, probe, dark)
    share = border_share(_expected(lights, probe.centre)[0])
    complete = share <= _OUTERMOST
    reasons = breaches(law, _near_the_border(lights, allowed)) if complete else []
    reasons += breaches(law, _at_the_border(lights, allowed, complete=complete))
    reasons += breaches(law, _flat(flat, dark, probe, allowed["flat"]))
    if reasons:
        fail(law, "; ".join(reasons))
    check_inside(share, probe.size, _OUTERMOST)


def _flat(flat: Image, dark: Image, probe: Probe, allowed: float) -> Iterator[Measured]:
    """Measure the outermost pixels of the blooms of a flat and a black image."""
    x, y = probe.centre
    ring, black = (
        np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]]).mean(axis=1)
        for image in (flat, dark)
    )
    glow = float(np.abs(black - dark[y, x].mean()).max()) / probe.value
    text = f"a black image has {glow:.3g} of the light of a flat one at its border"
    yield "dark", glow, allowed, text
    middle = float(flat[y, x].mean())
    if middle > 0:
        farthest = float(ring[np.abs(ring - middle).argmax()]) / middle
        text = f"a flat image has {farthest:.3g} times as much bloom in its outermost pixels as in "
        yield "flat", abs(farthest - 1), allowed, f"{text}the middle"


def _near_the_border(lights: _Lights, allowed: Mapping[str, float]) -> Iterator[Measured]:
    """Measure how lights 1.5 standard deviations from an edge differ from one in the middle."""
    for name, at in _near(lights).items():
        spread, error = lights.spread(at)
        expected, energy = _expected(lights, at)
        excess = np.abs(spread - expected) / energy
        excess[excess <= 2 * error / energy] = 0
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
        share = float(lights.spread(at)[0].sum()) / energy
        inside = float(expected.sum()) / energy
        kind = "corner" if name == "corner" else "edge"
        figure(f"energy_{name}", share)
        if complete:
            text = f"a light at the {name} has {share:.3g} of its energy, {inside:.3g} is in the "
            yield "lost", max(0.0, inside - share), allowed["lost"], f"{text}frame"
        text = f"a light at the {name} swells to {share:.3g} times its energy"
        yield kind, share, allowed[kind], text
    x, height = _PERIOD * round(x / _PERIOD), lights.probe.size[1]
    outermost = float(lights.spread((0, 0), sides=(1, height))[0].sum())
    # Of a linear bloom. A line in the middle decides only if the outermost one has too little.
    inner = _expected(lights, lights.probe.centre)[1] * height / _LIGHT**2
    if outermost < inner / 2:
        inner = float(lights.spread((x, 0), sides=(1, height))[0].sum())
    if inner > 0:
        share = outermost / inner
        text = f"a line in the outermost column has {share:.3g} of the energy of one in the middle"
        yield "column", max(0.0, 0.5 - share), 0.25, text


def _check_stale(bloom: Bloom, probe: Probe, dark: Image, allowed: float) -> Image:
    """Return the bloom of a flat image; that of a black one is the same after bright images."""
    width, height = (beside_multiple(min(side, 144)) + 3 for side in probe.size)
    smaller = dataclasses.replace(
        probe, size=(min(width, probe.size[0]), min(height, probe.size[1]))
    )
    flat = dark
    law = "the bloom of an image does not depend on the image before"
    for name, used in ((", larger", smaller), ("", probe)):
        flat = probe.apply(bloom, probe.flat(probe.value))[0]
        after = used.apply(bloom, used.flat(0.0))[0]
        rise = np.abs(after) - float(np.abs(dark).max()) if name else np.abs(after - dark)
        off = float(rise.max()) / probe.value
        y, x, _ = np.unravel_index(int(rise.argmax()), rise.shape)
        text = f"after a bright{name} image, a black one has {off:.3g} of its light at x {x}, y {y}"
        judge(law, ("stale", off, allowed, text))
    return flat


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
            result = np.asarray(bloom(given, region=(*map(int, corner), *probe.size)))  # type: ignore[call-arg]
            if result.shape[:2] == given.shape[:2]:
                result = np.split(result, 2, axis=axis)[second]
            results.append(probe.values(result, probe.given(noise[second])))
        (alone, error), (beside, _) = results
        off = np.abs(beside - alone)
        largest = float(np.abs(alone).max()) or 1.0
        share = max(0.0, float(off.max()) - 2 * error) / largest
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
    near = []
    for axis, side in enumerate(probe.size):
        profile = np.abs(spread.mean(axis=2)).sum(axis=axis)
        variance = profile @ (np.arange(side) - probe.centre[axis] - _LIGHT // 2) ** 2
        deviation = math.sqrt(float(variance / profile.sum())) if energy > 0 else 0.0
        near.append(min(max(math.ceil(1.5 * deviation) - _LIGHT // 2, 1), side // 4))
    return {"left": (near[0], probe.centre[1]), "top": (probe.centre[0], near[1])}


def _expected(lights: _Lights, at: tuple[int, int]) -> tuple[Image, float]:
    """Return the bloom of a light near the middle, moved to another place, and its energy.

    The light is a multiple of 16 pixels away, since a chain of halved images spreads each position
    of a period differently.
    """
    x, y = (
        position + _PERIOD * round((middle - position) / _PERIOD)
        for position, middle in zip(at, lights.probe.centre, strict=True)
    )
    spread = lights.spread((x, y))[0]
    energy = float(spread.sum())
    if not energy > 0:
        fail("the bloom of a lit pixel is not black", f"its energy is {energy:.3g}")
    return _moved(spread, (x, y), at), energy


def _moved(spread: Image, start: tuple[int, int], to: tuple[int, int]) -> Image:
    """Return an image moved by whole pixels, with black where it has none."""
    x, y = np.subtract(to, start)
    moved = np.roll(spread, (y, x), (0, 1))
    for lines, by in ((moved, y), (moved.swapaxes(0, 1), x)):
        lines[slice(by, None) if by < 0 else slice(by)] = 0
    return moved
