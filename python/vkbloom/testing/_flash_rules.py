"""The rules of Rec. ITU-R BT.1702 in numbers, and the result of each frame by its transitions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._numbers import check_index, check_number
from vkbloom._public import public

#: From the best to the worst.
FlashResult = Literal["pass", "warning", "extended failure", "failure"]
RESULTS: Final[tuple[FlashResult, ...]] = get_args(FlashResult)
_FAILED: Final = RESULTS.index("extended failure")


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class FlashRules:
    """The numbers by which `flash` judges: by default Rec. ITU-R BT.1702.

    A transition is a change of at least 20 cd/m2 whose darker picture is below 160 cd/m2, or a
    change to or from a saturated red. Two opposing transitions are a flash.

    Parameters
    ----------
    change : float
        The least change of luminance in cd/m2, above 0.
    dark : float
        The darker picture of a change is below this luminance, in cd/m2.
    contrast : float, optional
        On displays of HDR, changes whose darker picture is not below `dark` count from this
        Michelson contrast (a - b) / (a + b) on, 0 to 1. None: they do not count.
    red_change : float
        The least change of 320 max(0, R - G - B) of a saturated red, R / (R + G + B) of at least
        0.8, where 1 is the white; other colours have 0.
    area : float
        The least share of the picture that changes at the same time, 0 to 1.
    changes_of : {"pixels", "picture"}
        What changes by the numbers above: "pixels", a share `area` of them at the same time; or
        "picture", its mean, where a share `area` of the pixels changes at all in the same frame.
    max_transitions : int
        The most transitions within a second; more are a failure.
    min_transitions : int
        The fewest of a second that counts towards an extended failure.
    warning_transitions : int
        The fewest that give a warning.
    extended_seconds, extended_window : float
        An extended failure has `min_transitions` to `max_transitions` in this many seconds of the
        last `extended_window` seconds.
    stripes : int, optional
        The fewest light stripes of a harmful pattern. None: patterns are not judged.
    stripe_light : float
        The least mean luminance of light stripes in cd/m2. They are lighter than the dark ones by
        at least `change`.
    stripe_area : float
        The least share of the picture that stripes cover, 0 to 1.
    stripe_seconds : float
        How long a pattern may be shown.

    Notes
    -----
    Sources: Rec. ITU-R BT.1702, annex 1, and Ofcom's guidance on flashing images and regular
    patterns, for transitions, area, patterns and contrast; electronicarts/IRIS @ d96978ac,
    config/appsettings.json and src/TransitionTracker.cpp, for warnings and extended failures. The
    Recommendation says only that flashing of more than 5 seconds might be a risk even if it
    complies. ``FlashRules.iris()`` has the numbers of IRIS.
    """

    change: float = 20.0
    dark: float = 160.0
    contrast: float | None = 1 / 17
    red_change: float = 20.0
    area: float = 0.25
    changes_of: Literal["pixels", "picture"] = "pixels"
    max_transitions: int = 6
    min_transitions: int = 4
    warning_transitions: int = 4
    extended_seconds: float = 4.0
    extended_window: float = 5.0
    stripes: int | None = 6
    stripe_light: float = 50.0
    stripe_area: float = 0.25
    stripe_seconds: float = 0.5

    def __post_init__(self) -> None:
        for name in ("change", "red_change"):
            check_number(name, getattr(self, name), 1e-6, 1e5)
        for name in ("dark", "stripe_light"):
            check_number(name, getattr(self, name), 0.0, 1e5)
        for name in ("area", "stripe_area"):
            check_number(name, getattr(self, name), 1e-6, 1.0)
        for name in ("extended_seconds", "extended_window", "stripe_seconds"):
            check_number(name, getattr(self, name), 0.0, 3600.0)
        for name in ("max_transitions", "min_transitions", "warning_transitions"):
            check_index(name, getattr(self, name), 1, 10_000)
        if self.contrast is not None:
            check_number("contrast", self.contrast, 1e-6, 1 - 1e-6)
        if self.stripes is not None:
            check_index("stripes", self.stripes, 2, 10_000)
        if self.changes_of not in ("pixels", "picture"):
            raise ValueError(f"changes_of: {self.changes_of!r} is not one of pixels, picture")

    @classmethod
    def iris(cls) -> FlashRules:
        """Return the rules of EA's IRIS in its own configuration.

        A mean of the picture changes, luminances from 160 cd/m2 on do not count, and patterns are
        not judged. Frames are rounded to 8 bits of sRGB. With a white of 200 cd/m2, 20 and 160
        cd/m2 are its relative luminances 0.1 and 0.8.
        """
        return cls(contrast=None, changes_of="picture", stripes=None)


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True, eq=False)
class FlashTransitions:
    """Transitions of the luminance, or of the saturated red, of a sequence of N frames.

    Attributes
    ----------
    result : {"pass", "warning", "extended failure", "failure"}
        The worst of the frames.
    second : float or None
        Time of the first frame that is a failure or an extended failure; None: there is none.
    share : float or None
        Share of the picture that changed in the last transition up to there.
    transitions : ndarray of int, shape (N,)
        Transitions within the last second.
    extended : ndarray of int, shape (N,)
        Frames with the transitions of an extended failure, within its window.
    areas : ndarray of float64, shape (N,)
        Share of the picture that changes: at each frame for the rules of a picture; at the frames
        of transitions for those of pixels, and 0 elsewhere.
    results : tuple of str
        The result of each frame.
    """

    result: FlashResult
    second: float | None
    share: float | None
    transitions: NDArray[np.int64]
    extended: NDArray[np.int64]
    areas: NDArray[np.float64]
    results: tuple[FlashResult, ...]

    @property
    def failed(self) -> bool:
        """Whether there is a failure or an extended failure."""
        return RESULTS.index(self.result) >= _FAILED


def frames_of(seconds: float, fps: float) -> int:
    """Return the number of frames in a time, at least 1."""
    return max(1, math.floor(seconds * fps + 0.5))


def count_transitions(
    flags: Sequence[bool], areas: Sequence[float], fps: float, rules: FlashRules
) -> FlashTransitions:
    """Return the results of frames, of which `flags` says where a transition is."""
    transitions = _sum_last(np.array(flags, np.int64), frames_of(1, fps))
    within = (transitions >= rules.min_transitions) & (transitions <= rules.max_transitions)
    extended = _sum_last(within.astype(np.int64), frames_of(rules.extended_window, fps))
    is_extended = extended >= frames_of(rules.extended_seconds, fps)
    worst = np.zeros(len(transitions), np.int64)
    worst[transitions >= rules.warning_transitions] = RESULTS.index("warning")
    worst[is_extended & (transitions >= rules.min_transitions)] = _FAILED
    worst[transitions > rules.max_transitions] = RESULTS.index("failure")
    failed = np.flatnonzero(worst >= _FAILED)
    first = int(failed[0]) if failed.size else None
    share = np.array(areas, np.float64)
    return FlashTransitions(
        result=RESULTS[int(worst.max())],
        second=None if first is None else first / fps,
        share=None if first is None else float(share[np.flatnonzero(flags[: first + 1])[-1]]),
        transitions=transitions,
        extended=extended,
        areas=share,
        results=tuple(RESULTS[level] for level in worst),
    )


def _sum_last(values: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return the sum of the last `count` values at each of them."""
    total = np.cumsum(values)
    total[count:] -= total[:-count].copy()
    return total
