"""Laws of the point spread: where its light is, and whether it is a row times a column."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from vkbloom.testing._deviations import Findings, compare_with_law, figure, judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._moving_light import moments
from vkbloom.testing._point_spread import border_share, check_inside, check_lit
from vkbloom.testing._probe import Image
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# A mean shift that is named, in pixels.
_SHIFT: Final = 0.05


def _test_centroid(subject: Subject, limits: Limits) -> None:
    """Compare the centroid of the point spread, sum of h(x, y) (x, y) / sum of h, with the pixel.

    The limit is that of each axis, in addition to the effect of the errors of single values.
    """
    subject.check_spread_visible()
    probe, within = subject.probe, limits["off"]
    spread, error = subject.light
    check_lit(spread, error)
    check_inside(max(map(border_share, np.moveaxis(spread, 2, 0))), probe.size)
    position, errors = probe.centre, np.broadcast_to(error, spread.shape)
    findings = Findings("the centroid of the light of a pixel is that pixel", probe)
    for channel in range(spread.shape[2]):
        for axis, name in ((0, "x"), (1, "y")):
            profile = spread[:, :, channel].sum(axis=axis)
            distance = np.arange(len(profile), dtype=np.float64) - position[axis]
            off = float((profile * distance).sum() / profile.sum())
            plane = spread[:, :, channel], errors[:, :, channel]
            uncertain = _moment_error(*plane, axis, distance)
            allowed = within + uncertain
            text = (
                f"the centroid is {name} {position[axis] + off:.6g}, {off:+.3g} pixels from "
                f"{name} {position[axis]}, channel {channel}: {allowed:.3g} allowed"
            )
            if probe.levels is None:
                judge(findings.law, ("off", abs(off), allowed, text))
            else:
                findings.add([("off", abs(off), within, text, uncertain)])
                if findings.broken:
                    findings.conclude()
    findings.conclude()


def _moment_error(plane: Image, errors: Image, axis: int, weights: Image) -> float:
    """Return the error of a moment, for values with independent errors.

    Pixels without light are exactly 0 and have no error. Independent errors add as the root of the
    sum of squares; three times that is allowed.
    """
    lit = plane != 0
    along = np.broadcast_to(weights if axis == 0 else weights[:, np.newaxis], plane.shape)
    squares = (errors[lit] * along[lit]) ** 2
    return 3 * math.sqrt(float(squares.sum())) / abs(float(plane.sum()))


def _explain_shift(subject: Subject, why: str) -> str:
    """Return how far all light is shifted on average over all positions; `why` if it is not."""
    bloom, probe = subject.bloom, subject.probe
    # All positions of a period at once: a square whose side is a multiple of it.
    side = 2 ** int(math.log2(max(1, min(probe.size) // 4)))
    left, top = ((length - side) // 2 for length in probe.size)
    square = probe.point((left, top), probe.value, (side, side))
    lit = probe.apply(bloom, square)[0] - probe.apply(bloom, probe.flat(0.0))[0]
    to, start = (moments(light.mean(axis=2))[1] for light in (lit, square))
    mean = np.subtract(to, start)
    parts = []
    for axis, shift in zip("xy", mean, strict=True):
        figure(f"shift_{axis}", float(shift))
        if abs(shift) > _SHIFT:
            parts.append(f"{shift:+.3g} pixels along {axis}")
    if not parts:
        return why
    return (
        f"All light is shifted by {' and '.join(parts)}, on average over all positions. A chain of "
        "halved images moves light by nothing on average: a shift of half a texel comes from a "
        "pass that reads the corner of a pixel in place of its middle."
    )


CENTROID_KEPT: Final = Law(
    name="centroid_kept",
    test=_test_centroid,
    formula="the centroid of the light of a pixel is that pixel",
    figures={
        "off": Figure("distance along an axis, in pixels", 0.01),
        "shift_x": Figure("where the law is broken, the mean shift over all positions"),
        "shift_y": Figure("the same along y"),
    },
    why="A chain of halved images averages boxes of 2 x 2 pixels. The light of a pixel moves to "
    "the centre of its box, and back on average over all positions.",
    explain=_explain_shift,
)


def _test_separable(subject: Subject, limits: Limits) -> None:
    """Compare the point spread with the product of its brightest row and column.

    Equivalently, h as a matrix has rank 1, and its second singular value is 0 (Treitel and Shanks,
    "The Design of Multistage Separable Planar Filters", IEEE Transactions on Geoscience
    Electronics, 1971). A sum of separable layers is not separable.
    """
    subject.check_spread_visible()
    spread, error = subject.light
    check_lit(spread, error)
    product, allowed = np.empty_like(spread), np.empty_like(spread)
    errors = np.broadcast_to(error, spread.shape)
    shares = []
    for channel in range(spread.shape[2]):
        plane = spread[:, :, channel]
        y, x = np.unravel_index(int(np.abs(plane).argmax()), plane.shape)
        product[:, :, channel] = np.outer(plane[:, x], plane[y]) / plane[y, x]
        # The law has four values. None is larger than the divisor.
        off = errors[:, :, channel]
        allowed[:, :, channel] = off + off[y, x] + np.add.outer(off[:, x], off[y])
        singular = np.linalg.svd(plane, compute_uv=False)
        shares.append(float(singular[1] / singular[0]) if len(singular) > 1 else 0.0)
    law = "h(x, y) h(x0, y0) = h(x, y0) h(x0, y): the point spread is a row times a column"
    note = f"; the second singular value is {100 * max(shares):.3g} % of the first"
    limit = limits["off"]
    compare_with_law(subject.probe, law, spread, product, allowed, limit=limit, note=note)


SEPARABLE: Final = Law(
    name="separable",
    test=_test_separable,
    formula="h(x, y) h(x0, y0) = h(x, y0) h(x0, y)",
    figures={"off": Figure("largest difference of a value from a row times a column", 0.0)},
    why="A sum of several widths, such as the levels of a pyramid, is not a row times a column, "
    "even where each level is.",
)
