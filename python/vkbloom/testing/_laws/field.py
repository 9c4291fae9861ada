"""A law of blooms that depend on the place: a light shows the kernel of its own place."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Final

import numpy as np

from vkbloom.testing._deviations import Findings, Measured
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._point_spread import measure_spread, sum_error
from vkbloom.testing._probe import Probe
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# Places of lights along each axis.
_PLACES: Final = 3


def _test_field(subject: Subject, limits: Limits) -> None:
    """Compare the bloom of a pixel with the kernel of its place, at nine places.

    The places are as far apart as the kernels, which lie inside of the picture, allow.
    """
    if subject.field is None:
        raise ValueError("the bloom promises no field of kernels; give field=, a psf.Varying")
    findings = Findings("a light shows the kernel of its own place", subject.probe)
    for x, y in _places(subject.probe, subject.field.kernel_size):
        findings.add(_at(subject, x, y, limits))
    findings.conclude()


def _places(probe: Probe, kernel: tuple[int, int]) -> Iterator[tuple[int, int]]:
    lines = []
    for side, own in zip(probe.size, kernel, strict=True):
        first, last = own // 2, side - 1 - (own - 1 - own // 2)
        if first >= last:
            raise ValueError(
                f"probe: kernels of {kernel[0]} x {kernel[1]} have one place in an image of "
                f"{probe.size[0]} x {probe.size[1]}; a larger size is needed"
            )
        lines.append(np.linspace(first, last, _PLACES).round().astype(int).tolist())
    return itertools.product(*lines)


def _at(subject: Subject, x: int, y: int, limits: Limits) -> Iterator[Measured]:
    probe, field = subject.probe, subject.field
    assert field is not None
    kernel = field.at(x, y, frame=probe.size)
    if probe.colours < kernel.shape[2]:
        kernel = kernel.mean(axis=2, keepdims=True).repeat(probe.colours, axis=2)
    spread, error = measure_spread(subject.bloom, probe, (x, y), subject.dark)
    expected = np.zeros_like(spread)
    height, width = kernel.shape[:2]
    top, left = y - height // 2, x - width // 2
    expected[top : top + height, left : left + width] = kernel
    off, largest = spread - expected, float(np.abs(kernel).max())
    at = np.unravel_index(int(np.abs(off).argmax()), off.shape)
    share = abs(float(off[at])) / largest
    yield (
        "tap",
        share,
        limits["tap"],
        f"a light at x {x}, y {y} has {spread[at]:.6g} in place of its kernel's {expected[at]:.6g} "
        f"at x {at[1]}, y {at[0]}, channel {at[2]}: off by {share:.3g} of the largest tap",
        float(np.broadcast_to(error, off.shape)[at]) / largest,
    )
    light = float(np.abs(kernel).sum(axis=(0, 1)).max())
    sums = [np.maximum(part, 0).sum(axis=(0, 1)) for part in (off, -off)]
    share = float(np.max(sums)) / light
    uncertain = 0.0 if probe.levels is None else sum(sum_error(spread, error)) / light
    yield (
        "sum",
        share,
        limits["sum"],
        f"the light at x {x}, y {y} is off by {share:.3g} of its kernel's sum",
        uncertain,
    )


FIELD: Final = Law(
    name="field",
    test=_test_field,
    formula="a light shows the kernel of its own place, of the field that is promised",
    figures={
        "tap": Figure("largest difference of a value, as a share of the kernel's largest", 1e-3),
        "sum": Figure("light in wrong pixels, as a share of the kernel's sum", 1e-3),
    },
    why="A bloom that collects by the kernel of each pixel shows a mixture of kernels. Too few "
    "components of the field, or tiles of it, show the kernel of another place. A threshold and "
    "half a resolution change every kernel.",
    applies=lambda subject: subject.field is not None,
)
