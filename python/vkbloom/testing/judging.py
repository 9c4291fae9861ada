"""Framebuffers held against those of a reference, pass by pass."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import check_number
from vkbloom.views.comparison import Comparison, Metric, compare

__all__ = ["DEFAULTS", "Stage", "Tolerances", "Verdict", "first_failure", "judge", "judge_image"]

Stage = Literal["shape and dtype", "finiteness", "exact", "tolerances", "SSIM", "FLIP"]

#: (atol, rtol) of each dtype. Integers: one level, which is what a value near the middle of two
#: levels moves by. Half: four roundings of 2**-11 each, and absolutely a fortieth of an 8-bit
#: level, for what is left of larger values that cancel out. Float: what lavapipe's linear filter
#: of rgba32float is exact to.
DEFAULTS: Final[Mapping[str, tuple[float, float]]] = {
    "uint8": (1 / 255, 0.0),
    "uint16": (1 / 65535, 0.0),
    "float16": (1e-4, 2e-3),
    "float32": (1e-5, 1e-4),
    "float64": (1e-5, 1e-4),
}


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """How far an image may be from its reference, in the terms of OpenImageIO's `idiff`.

    Integers count as 0 to 1 in all of them. Each that is set must hold; images that are equal pass
    without further ado.

    Parameters
    ----------
    atol, rtol : float or None
        A pixel fails if a channel of it differs by more than atol + rtol * abs(reference):
        `idiff`'s ``fail`` and ``failrelative``. None: `DEFAULTS` of the dtype if both are None,
        else 0.
    fail_percent : float
        Percentage of pixels that may fail, 0 to 100: ``failpercent``.
    hard_fail : float or None
        Difference that no pixel may exceed, whatever `fail_percent` allows: ``hardfail``.
    warn : float or None
        Largest difference that passes without a warning: ``warn``.
    ssim : float or None
        Smallest structural similarity, -1 to 1.
    flip : float or None
        Largest mean FLIP, 0 to 1.
    allow_nan : bool
        Let NaN, and infinity of one sign, pass where both images have it.

    Raises
    ------
    ValueError
        A number is out of its range; names the field, the value and the range.
    TypeError
        A field is no number.
    """

    atol: float | None = None
    rtol: float | None = None
    fail_percent: float = 0.0
    hard_fail: float | None = None
    warn: float | None = None
    ssim: float | None = None
    flip: float | None = None
    allow_nan: bool = False

    def __post_init__(self) -> None:
        for name, low, high in (
            ("atol", 0.0, math.inf),
            ("rtol", 0.0, float(np.finfo(np.float64).max)),
            ("fail_percent", 0.0, 100.0),
            ("hard_fail", 0.0, math.inf),
            ("warn", 0.0, math.inf),
            ("ssim", -1.0, 1.0),
            ("flip", 0.0, 1.0),
        ):
            value = getattr(self, name)
            if value is not None:
                check_number(name, value, low, high)

    def of(self, dtype: np.dtype[Any]) -> tuple[float, float]:
        """Return atol and rtol for images of a dtype."""
        if self.atol is None and self.rtol is None:
            return DEFAULTS[dtype.name]
        return self.atol or 0.0, self.rtol or 0.0


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What was found out about one framebuffer.

    Parameters
    ----------
    name : str
        Of the framebuffer.
    failed_at : Stage or None
        The first check that failed; None: it passed.
    reasons : tuple of str
        Why it failed, one for each check that did.
    warning : str or None
        It passed, but differs by more than `Tolerances.warn`.
    comparison : Comparison or None
        The figures; None where shapes or dtypes differ, or one image is missing.
    atol, rtol : float
        What was applied.
    """

    name: str
    failed_at: Stage | None = None
    reasons: tuple[str, ...] = ()
    warning: str | None = None
    comparison: Comparison | None = None
    atol: float = 0.0
    rtol: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return self.failed_at is None

    @property
    def identical(self) -> bool:
        """Whether the images are equal to the bit, or for all that NaN tells."""
        return self.passed and self.comparison is not None and not self.comparison.max_error


def judge(
    expected: Mapping[str, NDArray[Any]],
    actual: Mapping[str, NDArray[Any]],
    tolerances: Tolerances,
) -> tuple[Verdict, ...]:
    """Compare framebuffers with those of a reference.

    Parameters
    ----------
    expected, actual : mapping of str to ndarray
        By name, in the order that the data flows. Arrays as
        `vkbloom.views.comparison.compare` takes them.
    tolerances : Tolerances

    Returns
    -------
    tuple of Verdict
        In the order of `actual`; framebuffers that only the reference has come where it has them.
    """
    return tuple(
        _of_missing(name, is_expected=name in expected)
        if name not in expected or name not in actual
        else judge_image(name, expected[name], actual[name], tolerances)
        for name in _merged(list(expected), list(actual))
    )


def first_failure(verdicts: tuple[Verdict, ...]) -> Verdict | None:
    """Return the first framebuffer, in the order that the data flows, that failed."""
    return next((verdict for verdict in verdicts if not verdict.passed), None)


def judge_image(
    name: str, expected: NDArray[Any], actual: NDArray[Any], tolerances: Tolerances
) -> Verdict:
    """Compare one image with its reference: shape and dtype, finiteness, values, SSIM, FLIP.

    Parameters
    ----------
    name : str
        Of the framebuffer.
    expected, actual : ndarray
    tolerances : Tolerances

    Returns
    -------
    Verdict
    """
    reasons = []
    if expected.shape != actual.shape:
        reasons.append(f"its shape is {actual.shape}, not {expected.shape}")
    if expected.dtype != actual.dtype:
        reasons.append(f"its dtype is {actual.dtype}, not {expected.dtype}")
    if reasons:
        return Verdict(name=name, failed_at="shape and dtype", reasons=tuple(reasons))
    atol, rtol = tolerances.of(expected.dtype)
    metrics: list[Metric] = []
    if tolerances.ssim is not None:
        metrics.append("ssim")
    if tolerances.flip is not None:
        metrics.append("flip")
    if np.array_equal(expected, actual):
        # No figure can fail then, and the slow ones need not be computed.
        metrics = []
    found = compare(
        expected,
        actual,
        threshold=atol,
        relative=rtol,
        allow_nan=tolerances.allow_nan,
        metrics=metrics,
    )
    failures = _failures(found, tolerances, metrics, (atol, rtol))
    warning = None
    if not failures and tolerances.warn is not None and (found.max_error or 0) > tolerances.warn:
        warning = f"{name}: {_worst(found)}, over {tolerances.warn:.6g}"
    return Verdict(
        name=name,
        failed_at=failures[0][0] if failures else None,
        reasons=tuple(reason for _, reason in failures),
        warning=warning,
        comparison=found,
        atol=atol,
        rtol=rtol,
    )


def _failures(
    found: Comparison, tolerances: Tolerances, metrics: list[Metric], limits: tuple[float, float]
) -> list[tuple[Stage, str]]:
    failures: list[tuple[Stage, str]] = [("finiteness", reason) for reason in found.mismatches]
    over = found.percent_over or 0.0
    if over > tolerances.fail_percent:
        stage: Stage = "tolerances" if any(limits) or tolerances.fail_percent else "exact"
        allowed = f", {tolerances.fail_percent:.4g} % allowed" if tolerances.fail_percent else ""
        reason = f"{over:.4g} % of the pixels {_limits_in_words(*limits)}{allowed}; {_worst(found)}"
        failures.append((stage, reason))
    hard, largest = tolerances.hard_fail, found.max_error or 0.0
    if hard is not None and largest > hard:
        failures.append(("tolerances", f"{_worst(found)}, over hard_fail {hard:.6g}"))
    if "ssim" in metrics and tolerances.ssim is not None:
        if found.ssim is None:
            failures.append(("SSIM", f"SSIM is not computed: {found.not_computed['ssim']}"))
        elif found.ssim < tolerances.ssim:
            failures.append(("SSIM", f"SSIM {found.ssim:.6g} is under {tolerances.ssim:.6g}"))
    if "flip" in metrics and tolerances.flip is not None:
        if found.flip is None:
            failures.append(("FLIP", f"FLIP is not computed: {found.not_computed['flip']}"))
        elif found.flip > tolerances.flip:
            failures.append(("FLIP", f"FLIP {found.flip:.6g} is over {tolerances.flip:.6g}"))
    return failures


def _limits_in_words(atol: float, rtol: float) -> str:
    if rtol:
        return f"differ by more than {atol:.4g} + {rtol:.4g} |reference|"
    return f"differ by more than {atol:.4g}" if atol else "differ"


def _worst(found: Comparison) -> str:
    """Describe the pixel with the largest difference."""
    if found.max_error_at is None or found.max_error_values is None:
        return "no finite value differs"
    x, y, channel = found.max_error_at
    expected, actual = found.max_error_values
    return (
        f"largest difference {found.max_error:.6g} at x {x}, y {y}, channel {channel}: "
        f"{actual:.6g}, not {expected:.6g}"
    )


def _of_missing(name: str, *, is_expected: bool) -> Verdict:
    reason = "it is missing" if is_expected else "the reference does not have it"
    return Verdict(name=name, failed_at="shape and dtype", reasons=(reason,))


def _merged(expected: list[str], actual: list[str]) -> list[str]:
    """Return the names of both: those of `actual`, each missing one after its predecessor."""
    names = list(actual)
    for index, name in enumerate(expected):
        if name not in names:
            before = expected[index - 1] if index else None
            names.insert(names.index(before) + 1 if before in names else 0, name)
    return names
