"""Laws of single values: what NaN and infinity reach, and what a reference has."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from vkbloom.testing._deviations import judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._probe import Bloom, call
from vkbloom.testing._subject import Subject

__tracebackhide__ = True


def _test_finite(subject: Subject, limits: Limits) -> None:
    probe = subject.probe
    if probe.dtype.kind == "u" or probe.levels is not None:
        where = str(probe.dtype) if probe.levels is None else probe.levels.reason
        raise ValueError(f"cannot be tested in {where}: integers are neither NaN nor infinity")
    law = "NaN and infinity of a pixel do not reach others"
    x, y = probe.centre
    blooms: dict[str, Bloom] = {"bloom": subject.bloom}
    if subject.picture is not None:
        blooms["picture"] = subject.picture
    for value in (math.nan, math.inf, -math.inf):
        image = probe.noise(0, probe.value)
        image[y, x] = value
        for name, bloom in blooms.items():
            result = np.asarray(call(bloom, probe.as_input(image)))
            reached = ~np.isfinite(result.reshape(*result.shape[:2], -1)).all(axis=2)
            reached[y, x] = False
            count, limit = int(reached.sum()), limits[name]
            text = f"{value} at x {x}, y {y} reaches {count} other pixels of the {name}: "
            judge(law, (name, count, limit, f"{text}{limit:g} allowed"))


FINITE: Final = Law(
    name="finite",
    test=_test_finite,
    formula="NaN and infinity of a pixel do not reach others",
    figures={
        "bloom": Figure("pixels of the bloom that NaN or infinity reaches", 0.0),
        "picture": Figure("the same of the picture with it", 0.0),
    },
    why="NaN and infinity spread through every average; a pass that reads them must replace them "
    "first.",
)


def _test_reference(subject: Subject, limits: Limits) -> None:
    if subject.differences is None:
        raise ValueError("the bloom has no reference")
    law = "each framebuffer is that of the reference"
    limit = limits["FRAMEBUFFER"]
    end = f"of its largest value, {limit:g} allowed"
    result = subject.reference.items()
    judge(law, *((name, off, limit, f"{name} is off by {off:.3g} {end}") for name, off in result))


REFERENCE: Final = Law(
    name="reference",
    test=_test_reference,
    formula="each framebuffer is that of the reference, as a share of its largest value",
    figures={
        "FRAMEBUFFER": Figure("largest difference, as a share of the largest value", 1e-3),
    },
    why="The reference computes something else, rounds differently, or reads other pixels at the "
    "border.",
    applies=lambda subject: subject.differences is not None,
)
