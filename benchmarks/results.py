"""Results of benchmarks: tables, goals, comparisons of pictures, and the times."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.timing import Times

__all__ = ["Agreement", "Goal", "Report", "Section", "Table", "agreement", "side_by_side"]


@dataclass(frozen=True)
class Agreement:
    """Whether two contenders make the same picture.

    Attributes
    ----------
    what : str
        The contender whose picture is compared with vkbloom's.
    largest : float
        The largest difference; NaN if they cannot be compared.
    allowed : float
        The largest allowed difference.
    reason : str
        The reason for `allowed`.
    """

    what: str
    largest: float
    allowed: float
    reason: str

    @property
    def agrees(self) -> bool:
        """Whether the difference is allowed; NaN is not."""
        return self.largest <= self.allowed


def agreement(
    what: str, ours: NDArray[Any], theirs: NDArray[Any], allowed: float, reason: str
) -> Agreement:
    """Compare the colours of two pictures, (H, W, 3) or (H, W, 4).

    Alpha is ignored, so that peers that blur it as a fourth channel need not restore it. Pictures
    of different shape or dtype, and pictures with NaN, do not agree.
    """
    if ours.shape[:2] != theirs.shape[:2] or ours.dtype != theirs.dtype:
        return Agreement(what, math.nan, allowed, reason)
    difference = ours[..., :3].astype(np.float32) - theirs[..., :3].astype(np.float32)
    return Agreement(what, float(np.abs(difference).max()), allowed, reason)


@dataclass(frozen=True)
class Goal:
    """A ratio that is wanted.

    Attributes
    ----------
    what : str
        The two contenders of the ratio.
    ratio : float
        The measured ratio.
    wanted : float
        The smallest ratio wanted, or the largest with `at_most`.
    at_most : bool
    """

    what: str
    ratio: float
    wanted: float
    at_most: bool = False

    @property
    def met(self) -> bool:
        """Whether the measured ratio meets the goal."""
        return self.ratio <= self.wanted if self.at_most else self.ratio >= self.wanted


@dataclass(frozen=True)
class Table:
    """Rows of text under a header, with a caption."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass
class Section:
    """The result of one benchmark.

    Attributes
    ----------
    id, title : str
    about : list of str
        Paragraphs about what was timed, and what the figures do not show.
    tables, goals, agreements : list
    missing : list of str
        Peers that did not take part, each with the reason.
    times : dict
        The times by name, for each group of contenders that took turns.
    """

    id: str
    title: str = ""
    about: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    goals: list[Goal] = field(default_factory=list)
    agreements: list[Agreement] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    times: dict[str, dict[str, Times]] = field(default_factory=dict)


@dataclass(frozen=True)
class Report:
    """The results of a run, with machine and command."""

    machine: dict[str, Any]
    sections: tuple[Section, ...]

    @property
    def disagreements(self) -> tuple[Agreement, ...]:
        """The comparisons that failed."""
        return tuple(
            found for section in self.sections for found in section.agreements if not found.agrees
        )


def side_by_side(caption: str, times: dict[str, Times], ours: str) -> Table:
    """Make a table of contenders that took turns, with their ratios to one of them."""
    rows = []
    for name, measured in times.items():
        ratio = "1" if name == ours else str(measured.over(times[ours]))
        rows.append((name, f"{1e3 * measured.median:.3f}", f"{1e3 * measured.least:.3f}", ratio))
    header = ("", "median, ms", "least, ms", f"times as long as {ours} (quartiles)")
    return Table(caption, header, tuple(rows))
