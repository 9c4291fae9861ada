"""Regular patterns of light and dark stripes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.testing._flash_rules import FlashRules, frames_of

Plane = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Of two periods that follow each other: the largest difference, as a share of the first and in
# pixels; and how many neighbouring lines a stripe crosses at least.
_REGULAR: Final = 0.25
_ROUNDED: Final = 1
_LINES: Final = 5
# Below this period in pixels, noise looks regular.
_MIN_PERIOD: Final = 4
# What lies around a stripe, by whose mean it is light or dark, as a share of the line.
_AROUND: Final = 3


class Stripes:
    """The share of each frame that harmful stripes cover, and from which frame on they fail."""

    def __init__(self, rules: FlashRules, stripes: int, fps: float) -> None:
        self.shares: list[float] = []
        self.failed_at: int | None = None
        self._rules, self._stripes = rules, stripes
        self._needed = frames_of(rules.stripe_seconds, fps)
        self._run = 0

    def add(self, luminance: Plane) -> None:
        """Judge the next frame, in cd/m2."""
        covered = find_stripes(luminance, self._stripes, self._rules.change)
        share = float(covered.mean())
        if share < self._rules.stripe_area or (
            _light_of(luminance[covered]) < self._rules.stripe_light
        ):
            share = 0.0
        self.shares.append(share)
        self._run = self._run + 1 if share else 0
        if self._run >= self._needed and self.failed_at is None:
            self.failed_at = len(self.shares) - 1


def find_stripes(luminance: Plane, count: int, change: float) -> Mask:
    """Return where at least `count` light stripes follow each other at a regular distance.

    Lines along both axes and both diagonals are searched. So stripes may be curved, radial, or rows
    of repeated elements.
    """
    covered = np.zeros(luminance.shape, np.bool_)
    for lines, back in _directions(luminance):
        covered |= back(_crossed(_search(lines, count, change)))
    return covered


class _Sheared:
    """The diagonals of an image as lines, and their values as an image again."""

    def __init__(self, shape: tuple[int, int], *, is_flipped: bool) -> None:
        y, x = np.indices(shape)
        across = x[:, ::-1] if is_flipped else x
        self._place = (y + across, y)
        self._shape = (sum(shape) - 1, shape[0])

    def lines(self, image: Plane) -> Plane:
        lines = np.full(self._shape, np.nan)
        lines[self._place] = image
        return lines

    def __call__(self, mask: Mask) -> Mask:
        image: Mask = mask[self._place]
        return image


def _directions(image: Plane) -> Iterator[tuple[Plane, Callable[[Mask], Mask]]]:
    yield image, lambda mask: mask
    yield image.T, lambda mask: mask.T
    for is_flipped in (False, True):
        sheared = _Sheared((image.shape[0], image.shape[1]), is_flipped=is_flipped)
        yield sheared.lines(image), sheared


def _search(lines: Plane, count: int, change: float) -> Mask:
    """Return where lines of values cross stripes; NaN: beyond the image."""
    length = lines.shape[1]
    inside = np.isfinite(lines)
    values = np.where(inside, lines, 0)
    light = inside & (values > _mean_around(values, inside))
    rising = light.copy()
    rising[:, 1:] &= ~light[:, :-1]
    starts = np.flatnonzero(rising)
    covered = np.zeros(lines.size + 1, np.int64)
    if starts.size < count:
        return covered[:-1].reshape(lines.shape).astype(np.bool_)
    highest = np.maximum.reduceat(values.ravel(), starts)
    lowest = np.minimum.reduceat(np.where(inside, lines, np.inf).ravel(), starts)
    period = np.diff(starts)
    is_clear = (highest - lowest >= change)[:-1] & (period >= _MIN_PERIOD)
    is_clear &= starts[1:] // length == starts[:-1] // length
    # Periods of one run differ little from the one before.
    goes_on = np.abs(np.diff(period)) <= np.maximum(_ROUNDED, _REGULAR * period[:-1])
    goes_on &= is_clear[1:] & is_clear[:-1]
    run = np.concatenate([[0], np.cumsum(~goes_on)])
    periods = np.bincount(run, weights=is_clear)
    for index in np.flatnonzero(periods >= count - 1):
        members = np.flatnonzero((run == index) & is_clear)
        first, last = starts[members[0]], starts[members[-1] + 1]
        end = min(last + period[members[-1]], (last // length + 1) * length)
        covered[first] += 1
        covered[end] -= 1
    return (np.cumsum(covered[:-1]) > 0).reshape(lines.shape) & inside


def _mean_around(values: Plane, inside: Mask) -> Plane:
    """Return the mean of a third of a line around each value."""
    length = values.shape[1]
    side = max(1, length // (2 * _AROUND))
    index = np.arange(length)
    first, end = np.maximum(index - side, 0), np.minimum(index + side + 1, length)
    sums, counts = (
        np.concatenate([np.zeros((len(one), 1)), np.cumsum(one, axis=1)], axis=1)
        for one in (values, inside.astype(np.float64))
    )
    mean: Plane = (sums[:, end] - sums[:, first]) / np.maximum(counts[:, end] - counts[:, first], 1)
    return mean


def _crossed(mask: Mask) -> Mask:
    """Return the mask where enough neighbouring lines have it."""
    lines = min(_LINES, mask.shape[0])
    rows = mask.shape[0] - lines + 1
    whole = np.logical_and.reduce([mask[i : i + rows] for i in range(lines)])
    result = np.zeros_like(mask)
    for i in range(lines):
        result[i : i + rows] |= whole
    return result


def _light_of(values: Plane) -> float:
    """Return the mean of the values above their mean."""
    light = values[values > values.mean()]
    return float(light.mean()) if light.size else float(values.mean())
