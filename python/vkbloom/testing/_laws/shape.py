"""Laws of the shape: whether the size of the image changes it, and how round it is."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from vkbloom.reference._glare import texels_at
from vkbloom.testing._deviations import Findings, Measured, fail, figure, judge
from vkbloom.testing._last_pixel import SMALL, LastPixel
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._moving_light import moments
from vkbloom.testing._point_spread import border_share, check_inside
from vkbloom.testing._probe import Bloom, Image, NotTaken, Probe, beside_multiple
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

#: Shares of the peak whose contours are measured.
LEVELS: Final = (0.5, 0.1, 0.01)
# Contours nearer to their middle, in pixels, are a few pixels, which are never round.
_MIN_RADIUS: Final = 3.0
_ANGLES: Final = 90
# The largest share of the light of a square in the outermost pixels.
_MAX_OUTER_SHARE: Final = 0.01
_SQUARE: Final = 16
# One pixel more or less, which is farthest from the next multiple, is most likely to differ.
_STEPS: Final = (1, -1, 3, -3, 2, -2)
_SIZES: Final = "the bloom of a square does not depend on whether the size is a multiple of 16"


def _test_sizes(subject: Subject, limits: Limits) -> None:
    """Compare the bloom of a square of 16 x 16 pixels in images of 16 n - 3 to 16 n + 3 pixels.

    n is the largest below the probe's size for which 16 n is no power of 2. The width is the root
    of the added variance, the centroid is taken beside that of the square. In an image of 16 n + 1
    pixels, the bloom of a flat image is the same share of its middle in the outermost pixels as in
    one of 16 n, and the last pixel is not lost.
    """
    bloom, probe, last = subject.bloom, subject.probe, subject.last_pixel
    dark = float(subject.dark[0].mean())
    # Small images first, which are faster. Where light leaves them, the probe's size decides.
    for most in (SMALL, max(probe.size)):
        is_small = most < max(probe.size)
        width, height = (beside_multiple(min(side, most)) for side in probe.size)
        sized = dataclasses.replace(probe, size=(width, height))
        findings, share = _compare_sizes(bloom, sized, dark, limits, last, is_small=is_small)
        if not (findings.broken or findings.undecided):
            return
        if findings.is_at_border or share <= _MAX_OUTER_SHARE:
            break
    else:
        check_inside(share, sized.size, _MAX_OUTER_SHARE)
    findings.conclude()


@dataclasses.dataclass
class _SizeFindings(Findings):
    """What differs from the first size; of each figure, the first difference."""

    is_at_border: bool = False
    named: set[str] = dataclasses.field(default_factory=set)

    def add_first(self, item: Measured) -> None:
        """Compare a deviation with its limit, unless one of its name is beyond it."""
        before = len(self.broken), len(self.undecided)
        if item[0] not in self.named:
            self.add([item])
        if before != (len(self.broken), len(self.undecided)):
            self.named.add(item[0])


def _compare_sizes(
    bloom: Bloom,
    probe: Probe,
    dark: float,
    limits: Limits,
    last: LastPixel,
    *,
    is_small: bool,
) -> tuple[_SizeFindings, float]:
    """Return what differs from the probe's size, and the share of light at the border there.

    In a small image that light leaves, the first difference is enough.
    """
    width, height = probe.size
    # At the same pixels in all sizes, since a chain of halved images spreads each differently.
    at = ((width - _SQUARE) // 2, (height - _SQUARE) // 2)
    base, base_error, outside = _square_figures(bloom, probe, at, dark)
    findings = _SizeFindings(_SIZES, probe)
    for step in _STEPS:
        sized = dataclasses.replace(probe, size=(width + step, height + step))
        result, result_error, _ = _square_figures(bloom, sized, at, dark)
        error = base_error + result_error
        spread = base[0] or math.inf
        off = {
            "width": (abs(result[0] - base[0]) / spread, error[0] / spread),
            "energy": (abs(result[1] - base[1]) / base[1], error[1] / base[1]),
            "centroid": (math.hypot(*(result[2:] - base[2:])), math.hypot(*error[2:])),
        }
        if step == 1:
            flat = _flatness(bloom, sized)
            if np.abs(flat - 1).max() > limits["flat"] / 10:
                flat += 1 - _flatness(bloom, probe)
            off["flat"] = float(np.abs(flat - 1).max()), 0.0
            findings.add_first(last.measure(base[1] / _SQUARE**2 / probe.value, limits["last"]))
            findings.is_at_border = bool(findings.broken) or off["flat"][0] > limits["flat"]
        for name, (value, uncertain) in off.items():
            unit = " pixels" if name == "centroid" else " of it"
            what = "the border of a flat image" if name == "flat" else f"the {name}"
            text = (
                f"at {sized.size[0]} x {sized.size[1]} {what} differs by {value:.3g}{unit} "
                f"from that at {width} x {height}: {limits[name]:.3g} allowed"
            )
            findings.add_first((name, value, limits[name], text, uncertain))
        if is_small and findings.named and outside > _MAX_OUTER_SHARE:
            break
    return findings, outside


def _flatness(bloom: Bloom, probe: Probe) -> Image:
    """Return the bloom of a flat image in its outermost rows and columns, as shares of its middle.

    The smallest and the largest value of each.
    """
    flat = probe.apply(bloom, probe.flat(probe.value))[0].mean(axis=2)
    middle = float(flat[probe.centre[1], probe.centre[0]])
    sides = (flat[0], flat[-1], flat[:, 0], flat[:, -1])
    values = np.array([extreme(side) for side in sides for extreme in (np.min, np.max)])
    return values / middle if middle > 0 else np.ones(len(values))


def _square_figures(
    bloom: Bloom, probe: Probe, at: tuple[int, int], dark: float
) -> tuple[Image, Image, float]:
    """Return figures of a square's bloom, their errors, and its share at the border.

    The figures are width, energy, shift along x and y.
    """
    image = probe.point(at, probe.value, (_SQUARE, _SQUARE))
    found, error = probe.apply(bloom, image)
    lit = found.mean(axis=2) - dark
    if not lit.sum() > 0:
        fail("the bloom of a square is not black", f"its energy is {lit.sum():.3g}")
    result, errors = _moments(lit, at), np.zeros(4)
    if probe.levels is not None:
        half = np.broadcast_to(error, found.shape).mean(axis=2) / 2
        rounded = [_moments(lit + by * half * (lit > half), at) for by in (-1, 1)]
        errors = np.abs(np.subtract(rounded, result)).max(axis=0)
    figure("squared_width", float(result[0] ** 2))
    return result, errors, border_share(lit)


def _moments(lit: Image, at: tuple[int, int]) -> Image:
    """Return width, energy, and shift along x and y of the bloom of a square."""
    energy, position, variance = moments(lit)
    squared = max(variance - 2 * (_SQUARE**2 - 1) / 12, 0.0)
    shift = np.subtract(position, at) - (_SQUARE - 1) / 2
    return np.array([math.sqrt(squared), energy, *shift])


SIZES: Final = Law(
    name="sizes",
    test=_test_sizes,
    formula="width, centroid and energy of the bloom of a square are the same in images whose "
    "sizes are 1 to 3 pixels beside a multiple of 16, and their last pixel is not lost",
    figures={
        "squared_width": Figure("largest squared width of the bloom of a square, in pixels"),
        "width": Figure("change of the width, as a share", 0.05),
        "centroid": Figure("change of the centroid, in pixels", 0.3),
        "energy": Figure("change of the light, as a share", 0.05),
        "flat": Figure("change of a flat image at its border, as a share of its middle", 0.1),
        "last": Figure("what the last pixel of an odd size lacks of a quarter of its light", 0.22),
    },
    why="A chain of halved images rounds each size: the levels cover a little more or less than "
    "the image, and a small image may have one level more.",
)


def _contours(spread: Image) -> dict[float, float]:
    """Return the greatest distance of contours from the centroid, divided by the smallest.

    By the share of the peak: 1/2, 1/10 and 1/100. Distances below three pixels count as three.
    Contours that are nearer everywhere, or that leave the image, are not in the result.
    """
    plane = spread.mean(axis=2)
    peak = float(plane.max())
    if not peak > 0:
        return {}
    # The core around the peak, since skirts may leave the image on one side.
    core = np.where(plane >= peak * LEVELS[0], plane, 0)
    _, (x, y), _ = moments(core)
    # The nearest border; a contour beyond it is not closed.
    most = min(x, y, plane.shape[1] - 1 - x, plane.shape[0] - 1 - y)
    steps = np.arange(0.0, most, 0.125)
    angles = np.arange(_ANGLES) * (2 * math.pi / _ANGLES)
    columns, rows = x + np.outer(np.cos(angles), steps), y + np.outer(np.sin(angles), steps)
    rays = texels_at(plane[..., np.newaxis], columns, rows)[..., 0]
    results = {}
    for level in LEVELS:
        above = rays >= level * peak
        if not above.any(axis=1).all() or above[:, -1].any():
            continue
        last = len(steps) - 1 - above[:, ::-1].argmax(axis=1)
        inner, outer = (rays[np.arange(_ANGLES), last + i] for i in (0, 1))
        radii = steps[last] + 0.125 * (inner - level * peak) / np.maximum(inner - outer, 1e-300)
        if radii.max() >= _MIN_RADIUS:
            results[level] = float(radii.max() / max(radii.min(), _MIN_RADIUS))
    return results


def _test_round(subject: Subject, limits: Limits) -> None:
    """Compare distances of contours from the centroid.

    The greatest is 1.41 times the smallest for a box, 1.21, 1.07 and 1.28 for a bilinear tent, and
    1 for a Gaussian.
    """
    subject.probe.check_fine("a hundredth of the peak of the bloom of a pixel is below a level")
    ratios = _contours(subject.spread)
    if not ratios:
        raise NotTaken("probe: no contour is inside of the image and three pixels from the middle")
    law = "the contours of the bloom of a pixel are circles"
    measured = []
    for level, ratio in ratios.items():
        name = f"round_{level:g}"
        text = f"at {level:g} of the peak, the contour is {ratio:.3g} times as far in one direction"
        text += f" as in another: {limits[name]:.3g} allowed"
        measured.append((name, ratio, limits[name], text))
    judge(law, *measured)


ROUND: Final = Law(
    name="round",
    test=_test_round,
    formula="contours of the bloom of a pixel at 1/2, 1/10 and 1/100 of the peak are circles",
    figures={
        f"round_{level:g}": Figure(
            f"greatest distance of the contour at {level:g} of the peak, divided by the smallest",
            1.35,
        )
        for level in LEVELS
    },
    why="Boxes and tents are square, streaks and blades are stars. A wide pyramid shows the square "
    "texels of its small levels.",
)
