"""Compare framebuffers with those of a reference, in the order of the data flow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._views.comparison import Comparison, compare
from vkbloom._views.diagnosis import Diagnosis, diagnose
from vkbloom._views.tolerances import Stage, Tolerances, failures

__all__ = ["Diagnosis", "Tolerances", "Verdict", "diagnose", "first_failure", "judge"]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The result of comparing one framebuffer.

    - `name`: Name of the framebuffer.
    - `failed_at`: The first check that failed; None if all passed.
    - `reasons`: One reason for each failed check.
    - `comparison`: The figures; None if shapes or dtypes differ, or one image is missing.
    - `diagnosis`: The cause of the difference of two images that failed.
    """

    name: str
    failed_at: Stage | None = None
    reasons: tuple[str, ...] = ()
    comparison: Comparison | None = None
    diagnosis: Diagnosis | None = None

    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return self.failed_at is None

    @property
    def identical(self) -> bool:
        """Whether all values are equal; NaN equals NaN if the tolerances allow it."""
        return self.passed and self.comparison is not None and not self.comparison.max_error


def judge(
    expected: Mapping[str, NDArray[Any]], actual: Mapping[str, NDArray[Any]], tolerances: Tolerances
) -> tuple[Verdict, ...]:
    """Compare framebuffers with those of a reference."""
    return tuple(
        Verdict(
            name=name,
            failed_at="shape and dtype",
            reasons=("it is missing" if name in expected else "the reference does not have it",),
        )
        if name not in expected or name not in actual
        else _judge_image(name, expected[name], actual[name], tolerances)
        for name in _merge(list(expected), list(actual))
    )


def first_failure(verdicts: tuple[Verdict, ...]) -> Verdict | None:
    """Return the first failed framebuffer in the order of the data flow."""
    return next((verdict for verdict in verdicts if not verdict.passed), None)


def _judge_image(
    name: str, expected: NDArray[Any], actual: NDArray[Any], tolerances: Tolerances
) -> Verdict:
    """Compare one image with its reference: shape and dtype, finiteness, values, SSIM, FLIP."""
    reasons = []
    if expected.shape != actual.shape:
        reasons.append(f"its shape is {actual.shape}, not {expected.shape}")
    if expected.dtype != actual.dtype:
        reasons.append(f"its dtype is {actual.dtype}, not {expected.dtype}")
    if reasons:
        return Verdict(
            name=name,
            failed_at="shape and dtype",
            reasons=tuple(reasons),
            diagnosis=diagnose(expected, actual),
        )
    atol, rtol = tolerances.of(expected.dtype)
    # Equal images pass every limit, so the slow metrics need not be computed.
    metrics = () if np.array_equal(expected, actual) else tolerances.metrics
    comparison = compare(
        expected,
        actual,
        threshold=atol,
        relative=rtol,
        allow_nan=tolerances.allow_nan,
        metrics=metrics,
    )
    failed = failures(comparison, tolerances, metrics)
    return Verdict(
        name=name,
        failed_at=failed[0][0] if failed else None,
        reasons=tuple(reason for _, reason in failed),
        comparison=comparison,
        diagnosis=diagnose(expected, actual) if failed else None,
    )


def _merge(expected: list[str], actual: list[str]) -> list[str]:
    """Return the names of `actual`, with each missing one of `expected` after its predecessor."""
    names = list(actual)
    for index, name in enumerate(expected):
        if name not in names:
            before = expected[index - 1] if index else None
            names.insert(names.index(before) + 1 if before in names else 0, name)
    return names
