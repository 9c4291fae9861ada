"""Transitions of a sequence: of the mean of a picture, as IRIS has them, and of pixels."""

from __future__ import annotations

import math
from collections import deque
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from vkbloom.testing._flash_rules import FlashRules

Plane = NDArray[np.float64]

# Allowance for roundings of a difference that is exactly the limit, as a share of it.
_EXACT: Final = 1e-6


class Limit(Protocol):
    """Returns the least change to count, whose darker side has the given values."""

    def __call__(self, darker: Plane) -> Plane: ...


def luminance_limit(rules: FlashRules, *, is_hdr: bool) -> Limit:
    """Return the limit of changes of luminance in cd/m2."""
    contrast = rules.contrast if is_hdr else None

    def limit(darker: Plane) -> Plane:
        # (a - b) / (a + b) >= c, for the darker b.
        bright = math.inf if contrast is None else darker * (2 * contrast / (1 - contrast))
        return np.where(darker < rules.dark, rules.change, bright)

    return limit


def red_limit(rules: FlashRules) -> Limit:
    """Return the limit of changes of a saturated red, whatever its luminance."""
    return lambda darker: np.full_like(darker, rules.red_change)


class PictureTransitions:
    """Transitions of the mean of a picture: src/Flash.cpp of electronicarts/IRIS @ d96978ac.

    A step counts if enough pixels differ at all from the last frame. Steps of the same direction
    within a second add up.
    """

    def __init__(self, limit: Limit, area: float, window: int) -> None:
        self.flags: list[bool] = []
        self.areas: list[float] = []
        self._limit, self._area = limit, area
        self._steps: deque[float] = deque([0.0], maxlen=window)
        self._trend = self._mean = 0.0
        self._last: Plane | None = None

    def add(self, plane: Plane) -> None:
        """Judge the next frame."""
        last, before = self._last, self._mean
        self._last, self._mean = plane, float(plane.mean())
        if last is None:
            self._record(is_transition=False, area=0.0)
            return
        area = float(np.mean(plane != last))
        step = self._mean - before if area >= self._area - _EXACT else 0.0
        trend = self._trend
        if trend * step < 0:
            self._steps.clear()
        # The oldest step leaves where there are as many as frames in a second.
        self._steps.append(step)
        self._trend = math.fsum(self._steps)
        limit = float(self._limit(np.array(min(before, self._mean)))) * (1 - _EXACT)
        goes_on = trend * self._trend >= 0 and abs(trend) >= limit
        self._record(is_transition=abs(self._trend) >= limit and not goes_on, area=area)

    def finish(self) -> None:
        """End the sequence."""

    def _record(self, *, is_transition: bool, area: float) -> None:
        self.flags.append(is_transition)
        self.areas.append(area)


class PixelTransitions:
    """Transitions of pixels that many pixels have at the same time.

    A change of a pixel runs from an extreme of the last second, and counts once it is as large as
    the limit. Its time is the shortest one up to there in which the pixel changes as much. Changes
    of pixels whose times overlap are one transition of the picture, where these pixels are a
    share `area` of it. It counts if it opposes the last one: its direction is another, or a share
    `area` of the picture has changed in both, and so must have changed back in between.
    """

    def __init__(self, limit: Limit, area: float, window: int) -> None:
        self.flags: list[bool] = []
        self.areas: list[float] = []
        self._limit, self._area, self._window = limit, area * (1 - _EXACT), window
        self._planes: deque[Plane] = deque(maxlen=window + 1)
        # Of each pixel: the direction of its change, when that began to count, and the extremes
        # since.
        self._direction = self._turned = np.zeros(0, np.int64)
        self._low = self._high = np.zeros(0)
        self._low_at = self._high_at = np.zeros(0, np.int64)
        # Changes that no transition has yet: first and last frame, direction, pixel.
        self._changes = np.zeros((4, 0), np.int64)
        # Directions of the last transition, and the pixels that had it since the direction before.
        self._last = (False, False)
        self._moved = np.zeros(0, np.bool_)

    def add(self, plane: Plane) -> None:
        """Judge the next frame."""
        flat = plane.ravel()
        now = len(self.flags)
        self.flags.append(False)
        self.areas.append(0.0)
        self._planes.append(flat)
        if now == 0:
            self._direction, self._turned = (np.zeros(flat.size, np.int64) for _ in range(2))
            self._low, self._high = flat.copy(), flat.copy()
            self._low_at, self._high_at = (np.zeros(flat.size, np.int64) for _ in range(2))
            self._moved = np.zeros(flat.size, np.bool_)
            return
        self._find_extremes(flat, now)
        rises = (self._direction != 1) & self._is_change(self._low, flat)
        falls = (self._direction != -1) & self._is_change(flat, self._high) & ~rises
        for turned, direction in ((rises, 1), (falls, -1)):
            self._begin(np.flatnonzero(turned), direction, now)
        # A change that has stopped for a second may count again.
        old = (now - self._turned >= self._window) & ~self._is_change(self._low, self._high)
        self._direction[old] = 0
        # All changes that may overlap with this frame are known.
        self._find_transition(now - self._window + 1)

    def finish(self) -> None:
        """End the sequence."""
        for frame in range(max(1, len(self.flags) - self._window + 1), len(self.flags)):
            self._find_transition(frame)

    def _is_change(self, darker: Plane, brighter: Plane) -> NDArray[np.bool_]:
        change: NDArray[np.bool_] = brighter - darker >= self._limit(darker) * (1 - _EXACT)
        return change

    def _find_extremes(self, flat: Plane, now: int) -> None:
        """Find the lowest and the highest value since the last turn, of the last second."""
        for values, frames, least in (
            (self._low, self._low_at, np.minimum),
            (self._high, self._high_at, np.maximum),
        ):
            frames[least(flat, values) == flat] = now
            least(flat, values, out=values)
            old = np.flatnonzero(frames < now - self._window)
            if old.size:
                # The latest one, so that it is the longest within the second.
                kept = np.stack([plane[old] for plane in reversed(self._planes)])
                at = kept.argmin(axis=0) if least is np.minimum else kept.argmax(axis=0)
                values[old] = kept[at, np.arange(old.size)]
                frames[old] = now - at

    def _begin(self, pixels: NDArray[np.intp], direction: int, now: int) -> None:
        """Record the changes of pixels that begin to count, and look for their ends."""
        if not pixels.size:
            return
        value = self._planes[-1][pixels]
        first = np.zeros(pixels.size, np.int64)
        left = np.arange(pixels.size)
        for back in range(1, len(self._planes)):
            before = self._planes[-1 - back][pixels[left]]
            pair = (before, value[left]) if direction == 1 else (value[left], before)
            changed = self._is_change(*pair)
            first[left[changed]] = now - back
            left = left[~changed]
            if not left.size:
                break
        new = [first, np.full(pixels.size, now), np.full(pixels.size, direction), pixels]
        self._changes = np.concatenate([self._changes, np.stack(new)], axis=1)
        self._direction[pixels], self._turned[pixels] = direction, now
        for values, frames in ((self._low, self._low_at), (self._high, self._high_at)):
            values[pixels], frames[pixels] = value, now

    def _find_transition(self, frame: int) -> None:
        """Make one transition of the changes at a frame, if they are many; they are then used."""
        self._changes = self._changes[:, self._changes[1] >= frame]
        first, last, direction, pixels = self._changes
        at_once = first < frame
        size = self._moved.size
        share = np.count_nonzero(at_once) / size
        if share < self._area:
            return
        # The frame at which as many pixels as needed have changed.
        needed = max(0, math.ceil(self._area * size) - 1)
        when = int(np.partition(last[at_once], needed)[needed])
        rising = np.count_nonzero(at_once & (direction == 1)) / size
        directions = (bool(rising >= self._area), bool(share - rising >= self._area))
        moved = pixels[at_once]
        if self._opposes(directions if any(directions) else (True, True), moved):
            self.flags[when], self.areas[when] = True, share
        self._changes = self._changes[:, ~at_once]

    def _opposes(self, directions: tuple[bool, bool], pixels: NDArray[np.int64]) -> bool:
        """Return whether a transition opposes the last one, which it replaces."""
        is_new = directions != self._last
        if is_new or self._moved[pixels].sum() / self._moved.size >= self._area:
            self._last = directions
            self._moved[:] = False
            is_new = True
        self._moved[pixels] = True
        return is_new
