"""The bloom of the last pixel of an image with odd sides, which a chain of halvings may drop."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

from vkbloom.testing._deviations import Measured
from vkbloom.testing._point_spread import sum_error
from vkbloom.testing._probe import Bloom, Probe, beside_multiple

__tracebackhide__ = True

# The share of the light of the last pixel that is in the frame, in the corner of the image.
_LAST: Final = 0.25
#: The longest side of the image, less the odd pixel.
SMALL: Final = 144


@dataclasses.dataclass(frozen=True)
class LastPixel:
    """The bloom of the last pixel of an image with odd sides.

    A chain of halved images may drop the last column and row there.
    """

    bloom: Bloom
    probe: Probe
    is_dark: bool
    light: float
    error: float

    def measure(self, energy: float, allowed: float) -> Measured:
        """Return what its light lacks of a quarter; `energy`: of a pixel of 1 in the middle."""
        share = self.light / energy
        # Of a linear bloom. A pixel in the middle decides only if this one has too little.
        if share < _LAST:
            x, y = (16 * round(side / 32) for side in self.probe.size)
            energy = _light(self.bloom, self.probe, (x, y), is_dark=self.is_dark)[0]
            share = self.light / energy if energy > 0 else math.inf
        width, height = self.probe.size
        off, error = max(0.0, _LAST - share), self.error / energy if energy > 0 else 0.0
        text = f"at {width} x {height} the last pixel has {share:.3g} of the energy of one in the "
        return "last", off, allowed, f"{text}middle", error


def last_pixel(bloom: Bloom, probe: Probe, *, is_dark: bool) -> LastPixel:
    """Return the bloom of the last pixel of an image of 16 n + 1 pixels, at most 145.

    `is_dark`: Whether the bloom of a black image is black.
    """
    width, height = (beside_multiple(min(side, SMALL)) + 1 for side in probe.size)
    sized = dataclasses.replace(probe, size=(width, height))
    light, error = _light(bloom, sized, (width - 1, height - 1), is_dark=is_dark)
    return LastPixel(bloom, sized, is_dark, light, error)


def _light(
    bloom: Bloom, probe: Probe, at: tuple[int, int], *, is_dark: bool
) -> tuple[float, float]:
    """Return the light of the bloom of a pixel, divided by its value, and the error of this sum."""
    found, error = probe.apply(bloom, probe.point(at, probe.value))
    rounded = 0.0 if probe.levels is None else sum_error(found, error)[0]
    if not is_dark:
        found = found - probe.apply(bloom, probe.flat(0.0))[0]
    return float(found.mean(axis=2).sum()) / probe.value, rounded / probe.value
