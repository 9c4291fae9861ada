"""Laws of a moving light and of a scaled scene."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.testing._deviations import fail, judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._moving_light import Stability
from vkbloom.testing._point_spread import check_inside
from vkbloom.testing._probe import Probe
from vkbloom.testing._subject import TEXEL, Subject

__tracebackhide__ = True


def _test_stability(subject: Subject, limits: Limits) -> None:
    subject.probe.check_fine("the bloom of a light smaller than a pixel has a few levels")
    result = subject.stability
    if not result.energy.max() > 0:
        raise ValueError("the bloom of a small light is black")
    # Without a figure, such as the radius of a negative variance, there is nothing to judge.
    known = {name: item for name, item in limits.items() if math.isfinite(getattr(result, name))}
    try:
        _compare_stability(result, known, subject.lamp)
    except ValueError:
        # At each pixel of the path, no more light leaves the image than lies in its outermost
        # pixels. So energy and peak may still be wrong by more than that; place and width may not.
        lost = TEXEL * result.at_border
        judged = ("ripple", "shimmer")
        loose = {name: known[name] + lost for name in known if name in judged}
        whole = dataclasses.replace(result, at_border=0.0)
        _compare_stability(whole, loose, subject.lamp)
        raise


def _compare_stability(figures: Stability, limits: Limits, probe: Probe) -> None:
    """Raise AssertionError if a figure is above its limit, ValueError if light is cut off."""
    if not figures.energy.max() > 0:
        text = f"the largest sum of the bloom is {figures.energy.max():.3g}: only sums above 0 are "
        fail("the bloom of a light is not black", f"{text}allowed")
    check_inside(figures.at_border, probe.size)
    change = "changes by {:.3g} of its mean"
    shown = {
        "ripple": ("energy", figures.energy, change),
        "jitter": (
            *("centroid", np.hypot(figures.shift[..., 0], figures.shift[..., 1])),
            "is {:.3g} pixels from that of the image",
        ),
        "shimmer": ("peak", figures.peak / figures.ideal, f"{change}, beside a convolution's"),
        "growth": ("radius", figures.radius, change),
    }
    measured = []
    for name, limit in limits.items():
        (what, values, how), off = shown[name], getattr(figures, name)
        text = f"the {what} of the bloom {how.format(off)}, {_extremes(figures, values)}"
        measured.append((name, off, limit, f"{text}: {limit:.3g} allowed"))
    law = "the bloom stays the same while a light smaller than a pixel moves"
    judge(law, *measured)


def _extremes(figures: Stability, values: NDArray[np.float64]) -> str:
    """Return a text with the positions of the smallest and the largest value."""
    parts = []
    for index in (np.nanargmin(values), np.nanargmax(values)):
        position = np.unravel_index(int(index), values.shape)
        x, y = figures.positions[position]
        parts.append(f"{values[position]:.4g} with the light at x {x:.4g}, y {y:.4g}")
    return f"from {parts[0]} to {parts[1]}"


STABILITY: Final = Law(
    name="stability",
    test=_test_stability,
    formula="while a light smaller than a pixel moves over 8 pixels, its bloom keeps energy, "
    "radius, the centroid of the image and the peak that a convolution has",
    figures={
        "ripple": Figure("(largest - smallest) / mean light", 0.02),
        "jitter": Figure("distance of the centroid from that of the image, in pixels", 0.1),
        "shimmer": Figure("(largest - smallest) / mean peak, beside a convolution's", 0.1),
        "growth": Figure("(largest - smallest) / mean radius", 0.05),
    },
    why="A chain of halved images whose filter skips pixels gives a small light another brightness "
    "at each position: it shimmers.",
)


def _test_resolution(subject: Subject, limits: Limits) -> None:
    result, probe = subject.resolution, subject.probe
    if not all(values.mean() > 0 for values in (result.r50, result.r90, result.peak)):
        raise ValueError("the bloom of a light is black at some size")
    for name, what, values in (
        ("r50", "the radius of 50 % of the light", result.r50),
        ("r90", "the radius of 90 % of the light", result.r90),
        ("peak", "the peak of the bloom", result.peak),
    ):
        share = "the light's value" if name == "peak" else "the height"
        low, high = int(values.argmin()), int(values.argmax())
        change = float((values[high] - values[low]) / values.mean())
        law = f"{what} is the same share of {share} at all sizes"
        text = (
            f"{what} is {values[low]:.4g} of {share} at {_format(result.sizes[low])} and "
            f"{values[high]:.4g} at {_format(result.sizes[high])}: off by {change:.3g} of the "
            f"mean, {limits[name]:.3g} allowed"
        )
        errors = result.errors.get(name, np.zeros(len(values)))
        error = float((errors[low] + errors[high]) / values.mean())
        judge(law, (name, change, limits[name], text, error), probe=probe)


def _format(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"


RESOLUTION: Final = Law(
    name="resolution",
    test=_test_resolution,
    formula="radii and peak are the same share of the picture at four sizes",
    figures={
        "r50": Figure("(largest - smallest) / mean radius that has 50 % of the light", 0.1),
        "r90": Figure("the same of 90 %", 0.1),
        "peak": Figure("(largest - smallest) / mean peak", 0.2),
    },
    why="A width in pixels, or a fixed number of levels, is another share of the picture at each "
    "size.",
)
