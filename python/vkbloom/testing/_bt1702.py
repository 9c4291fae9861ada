"""Flashes and patterns by Rec. ITU-R BT.1702."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import LUMINANCE
from vkbloom._io.srgb import encode_srgb
from vkbloom._public import public
from vkbloom.testing._display import Display
from vkbloom.testing._flash_rules import (
    RESULTS,
    FlashResult,
    FlashRules,
    FlashTransitions,
    count_transitions,
    frames_of,
)
from vkbloom.testing._stripes import Stripes
from vkbloom.testing._transitions import (
    PictureTransitions,
    PixelTransitions,
    luminance_limit,
    red_limit,
)

Plane = NDArray[np.float64]

_LUMINANCE: Final = np.array(LUMINANCE)
# The longer sides, in pixels, of the pictures whose pixels and whose stripes are judged.
_PIXELS: Final = 160
_STRIPE_PIXELS: Final = 480
_RED: Final = 0.8
_RED_SCALE: Final = 320.0
_EXACT: Final = 1e-6


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True, eq=False)
class FlashVerdict:
    """Flashes and patterns of a sequence of N frames, by Rec. ITU-R BT.1702.

    Attributes
    ----------
    result : {"pass", "warning", "extended failure", "failure"}
        The worst of all.
    general, red, pattern : bool
        Whether the sequence fails by flashes of its luminance, by red flashes, and by patterns: by
        a failure or an extended failure.
    luminance, saturated_red : FlashTransitions
        Results, transitions and counts of each frame.
    stripes : ndarray of float64, shape (N,), or None
        Share of each frame that harmful stripes cover; 0 where it is less than the rules allow.
        None: patterns are not judged.
    stripes_second : float or None
        Time from which on stripes have been shown for too long. None: there is none.
    """

    result: FlashResult
    general: bool
    red: bool
    pattern: bool
    luminance: FlashTransitions
    saturated_red: FlashTransitions
    stripes: Plane | None
    stripes_second: float | None

    @property
    def failed(self) -> bool:
        """Whether the sequence fails."""
        return self.general or self.red or self.pattern

    def __str__(self) -> str:
        """Return a line for each kind of flash, and one for patterns."""
        lines = []
        for name, found in (("general", self.luminance), ("red", self.saturated_red)):
            text = f"{name} flashes: {found.result}, up to {found.transitions.max()} transitions a"
            text += " second"
            if found.second is not None and found.share is not None:
                text += f", from {found.second:.3g} s on, {100 * found.share:.3g} % of the picture"
            lines.append(text)
        if self.stripes is not None:
            lines.append("patterns: pass")
        if self.stripes is not None and self.stripes_second is not None:
            lines[-1] = (
                f"patterns: failure, from {self.stripes_second:.3g} s on, stripes on up to "
                f"{100 * self.stripes.max():.3g} % of the picture"
            )
        return "\n".join(lines)


def judge_flashes(
    frames: Iterable[NDArray[Any]], fps: float, rules: FlashRules, display: Display
) -> FlashVerdict:
    """Return the verdict of checked frames."""
    is_picture = rules.changes_of == "picture"
    kind = PictureTransitions if is_picture else PixelTransitions
    window = frames_of(1, fps)
    luminances = kind(luminance_limit(rules, is_hdr=display.is_hdr), rules.area, window)
    reds = kind(red_limit(rules), rules.area, window)
    stripes = None if rules.stripes is None else Stripes(rules, rules.stripes, fps)
    for frame in frames:
        light = display.light_of(_round_to_8_bits(frame, display) if is_picture else frame)
        small = light if is_picture else _reduce(light, _PIXELS)
        luminances.add(small @ _LUMINANCE)
        reds.add(_red_of(small / display.white_luminance))
        if stripes is not None:
            stripes.add(_reduce(light, _STRIPE_PIXELS) @ _LUMINANCE)
    luminances.finish()
    reds.finish()
    luminance, red = (
        count_transitions(found.flags, found.areas, fps, rules) for found in (luminances, reds)
    )
    failed_at = None if stripes is None else stripes.failed_at
    pattern: FlashResult = "pass" if failed_at is None else "failure"
    return FlashVerdict(
        result=max(luminance.result, red.result, pattern, key=RESULTS.index),
        general=luminance.failed,
        red=red.failed,
        pattern=failed_at is not None,
        luminance=luminance,
        saturated_red=red,
        stripes=None if stripes is None else np.array(stripes.shares),
        stripes_second=None if failed_at is None else failed_at / fps,
    )


def _round_to_8_bits(frame: NDArray[Any], display: Display) -> NDArray[Any]:
    """Return the picture that IRIS reads: 8 bits of sRGB; others of a display of HDR stay."""
    if frame.dtype == np.uint8 or display.is_hdr:
        return frame
    colours = frame[..., :3]
    if colours.dtype.kind == "f":
        encoded = encode_srgb(np.clip(np.nan_to_num(colours.astype(np.float64)), 0, 1))
    else:
        encoded = colours / np.iinfo(colours.dtype).max
    rounded: NDArray[np.uint8] = np.rint(255 * encoded).astype(np.uint8)
    return rounded


def _red_of(light: Plane) -> Plane:
    """Return 320 max(0, R - G - B) of a saturated red, 0 of other colours."""
    red, green, blue = np.moveaxis(light, -1, 0)
    total = light.sum(axis=-1)
    is_saturated = (total > 0) & (red >= (_RED - _EXACT) * total)
    return np.where(is_saturated, _RED_SCALE * np.maximum(0, red - green - blue), 0)


def _reduce(light: Plane, longest: int) -> Plane:
    """Return the means of square boxes, so that the longer side has at most `longest`."""
    height, width, _ = light.shape
    side = min(-(-max(height, width) // longest), height, width)
    if side <= 1:
        return light
    rows, columns = (np.arange(0, n, side) for n in (height, width))
    sums = np.add.reduceat(np.add.reduceat(light, rows, axis=0), columns, axis=1)
    counts = np.outer(np.diff([*rows, height]), np.diff([*columns, width]))
    means: Plane = sums / counts[..., np.newaxis]
    return means
