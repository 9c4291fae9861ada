"""Tolerances of image comparisons, and the limits that a comparison exceeds."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom._views.comparison import METRICS, Comparison, Metric

Stage = Literal["shape and dtype", "finiteness", "exact", "tolerances", "SSIM", "FLIP"]

#: (atol, rtol) of each dtype. Integers: one level, by which a value near the middle of two levels
#: may change. Half: relative, four roundings of 2**-11 each; absolute, a fortieth of an 8-bit
#: level, for differences of larger values. Float: the accuracy of lavapipe's linear filter of
#: rgba32float.
DEFAULTS: Final[Mapping[str, tuple[float, float]]] = {
    "uint8": (1 / 255, 0.0),
    "uint16": (1 / 65535, 0.0),
    "float16": (1e-4, 2e-3),
    "float32": (1e-5, 1e-4),
    "float64": (1e-5, 1e-4),
}


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """The allowed differences of an image from its reference, named as in OpenImageIO's `idiff`.

    Integers are scaled to 0..1. Every limit that is set must hold; equal images always pass.

    Parameters
    ----------
    atol, rtol : float or None
        A pixel fails if one of its channels differs by more than atol + rtol * abs(reference):
        ``fail`` and ``failrelative`` of `idiff`. If both are None, they follow from the dtype;
        otherwise None is 0.
    fail_percent : float
        Percentage of pixels that may fail, 0 to 100: ``failpercent``.
    hard_fail : float or None
        Difference that no pixel may exceed, independent of `fail_percent`: ``hardfail``.
    ssim : float or None
        Smallest structural similarity, -1 to 1.
    flip : float or None
        Largest mean FLIP, 0 to 1.
    allow_nan : bool
        Whether NaN, and infinity of the same sign, pass if both images have it.

    Raises
    ------
    ValueError
        A number is out of its range; the message names the field, the value and the range.

    Examples
    --------
    In place of those of `FrameRegression.check`:

    >>> tolerances = vkbloom.testing.Tolerances(atol=2 / 255, fail_percent=0.1)
    >>> tolerances.fail_percent
    0.1
    """

    atol: float | None = None
    rtol: float | None = None
    fail_percent: float = 0.0
    hard_fail: float | None = None
    ssim: float | None = None
    flip: float | None = None
    allow_nan: bool = False

    def __post_init__(self) -> None:
        for name, low, high in (
            ("atol", 0.0, math.inf),
            ("rtol", 0.0, float(np.finfo(np.float64).max)),
            ("fail_percent", 0.0, 100.0),
            ("hard_fail", 0.0, math.inf),
            ("ssim", -1.0, 1.0),
            ("flip", 0.0, 1.0),
        ):
            value = getattr(self, name)
            if value is not None or name == "fail_percent":
                check_number(name, value, low, high)
        if not isinstance(self.allow_nan, bool | np.bool_):
            raise TypeError(f"allow_nan: {self.allow_nan!r} is not a bool")

    def of(self, dtype: np.dtype[Any]) -> tuple[float, float]:
        """Return atol and rtol for images of a dtype."""
        if self.atol is None and self.rtol is None:
            return DEFAULTS[dtype.name]
        return self.atol or 0.0, self.rtol or 0.0

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """The metrics that have a limit, which `compare` must compute."""
        return tuple(name for name in METRICS if getattr(self, name, None) is not None)


def failures(
    comparison: Comparison, tolerances: Tolerances, metrics: Collection[Metric]
) -> list[tuple[Stage, str]]:
    """List the limits that a comparison exceeds."""
    failed: list[tuple[Stage, str]] = [("finiteness", reason) for reason in comparison.mismatches]
    over = comparison.percent_over or 0.0
    limits = (comparison.threshold, comparison.relative)
    if over > tolerances.fail_percent:
        stage: Stage = "tolerances" if any(limits) or tolerances.fail_percent else "exact"
        allowed = f", {tolerances.fail_percent:.4g} % allowed" if tolerances.fail_percent else ""
        reason = (
            f"{over:.4g} % of the pixels {_limits_in_words(*limits)}{allowed}; {worst(comparison)}"
        )
        failed.append((stage, reason))
    hard, largest = tolerances.hard_fail, comparison.max_error or 0.0
    if hard is not None and largest > hard:
        failed.append(("tolerances", f"{worst(comparison)}, over {hard:.6g}, the most allowed"))
    names: dict[Metric, Stage] = {"ssim": "SSIM", "flip": "FLIP"}
    for metric, name in names.items():
        value, limit = getattr(comparison, metric), getattr(tolerances, metric)
        if metric not in metrics or limit is None:
            continue
        if value is None:
            # For images that do not match, the reason has already been given.
            if not comparison.mismatches:
                why = comparison.not_computed.get(metric, "no values to compare")
                failed.append((name, f"{name} is not computed: {why}"))
        elif metric == "flip" and value > limit:
            failed.append((name, f"{name} {value:.6g} is over {limit:.6g}"))
        elif metric != "flip" and value < limit:
            failed.append((name, f"{name} {value:.6g} is under {limit:.6g}"))
    return failed


def _limits_in_words(atol: float, rtol: float) -> str:
    if rtol:
        return f"differ by more than {atol:.4g} + {rtol:.4g} |reference|"
    return f"differ by more than {atol:.4g}" if atol else "differ"


def worst(comparison: Comparison) -> str:
    """Describe the pixel with the largest difference."""
    if comparison.max_error_at is None or comparison.max_error_values is None:
        return "no finite value differs"
    x, y, channel = comparison.max_error_at
    expected, actual = comparison.max_error_values
    return (
        f"largest difference {comparison.max_error:.6g} at x {x}, y {y}, channel {channel}: "
        f"{actual:.6g}, not {expected:.6g}"
    )
