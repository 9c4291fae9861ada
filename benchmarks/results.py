"""Results of benchmarks: records, tables, goals, comparisons of pictures, and the times."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.timing import WALL, Estimate, Times, estimate
from vkbloom._doctor.deviations import deviation, real, tolerance

__all__ = [
    "Agreement",
    "Goal",
    "Record",
    "Report",
    "Section",
    "Table",
    "agreement",
    "equality",
    "side_by_side",
]

#: Stages of half floats between an image and its bloom, at most.
STAGES: Final = 12


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


def equality(what: str, ours: NDArray[Any], theirs: NDArray[Any]) -> Agreement:
    """Compare two pictures of vkbloom with the tolerance that its tests have of the reference.

    Variants round at the same places but for blurs into another size and transforms, whose error
    is relative to the largest value.
    """
    expected = real(ours)
    limit = tolerance(ours.dtype, expected, stages_of_8_bits=2, stages=STAGES)
    found = deviation(what, theirs, expected, limit + 0.01 * tolerance(np.float32, expected))
    reason = "the tolerance of the tests, at that pixel"
    off = found.off if found.off > found.allowed or not found.wrong else math.nan
    return Agreement(what, off, found.allowed, reason)


@dataclass(frozen=True)
class Goal:
    """A ratio that is wanted.

    Attributes
    ----------
    what : str
        The two contenders of the ratio.
    ratio : Estimate
        The measured ratio.
    wanted : float
        The smallest ratio wanted, or the largest with `at_most`.
    at_most : bool
    """

    what: str
    ratio: Estimate
    wanted: float
    at_most: bool = False

    @property
    def met(self) -> bool:
        """Whether the measured ratio meets the goal."""
        ratio = self.ratio.value
        return ratio <= self.wanted if self.at_most else ratio >= self.wanted


@dataclass(frozen=True)
class Record:
    """One figure: what a contender of a group took.

    Attributes
    ----------
    group, name : str
    clock : str
        The clock of a time; "" for other figures.
    unit : str
        "ms" or "MiB".
    value : Estimate
        The median with its interval.
    of : str
        The contender that `ratio` is relative to; "" for itself, or where there is none.
    ratio : Estimate or None
        How many times as much as `of`.
    """

    group: str
    name: str
    clock: str
    unit: str
    value: Estimate
    of: str = ""
    ratio: Estimate | None = None


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
    records : list of Record
        What the pages of the documentation may show.
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
    records: list[Record] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    times: dict[str, dict[str, Times]] = field(default_factory=dict)

    def add_times(
        self,
        group: str,
        times: dict[str, Times],
        clock: str | Mapping[str, str] = WALL,
        ours: str = "",
    ) -> None:
        """Add a group of contenders that took turns, and a record of each.

        - `clock`: Of all contenders, or of each by its name.
        - `ours`: The contender that ratios are relative to.
        """
        self.times[group] = times
        for name, measured in times.items():
            has_ratio = ours in times and name != ours
            value = Estimate(*(1e3 * each for each in measured.estimate()))
            self.records.append(
                Record(
                    group,
                    name,
                    clock if isinstance(clock, str) else clock[name],
                    "ms",
                    value,
                    ours if has_ratio else "",
                    measured.over(times[ours]) if has_ratio else None,
                )
            )

    def add_memory(self, group: str, name: str, mebibytes: Sequence[float]) -> None:
        """Add a record of memory, measured one or several times."""
        self.records.append(Record(group, name, "", "MiB", estimate(mebibytes)))


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
        ratio = "1" if name == ours else ""
        if name != ours and ours in times:
            ratio = str(measured.over(times[ours]))
        value, low, high = (f"{1e3 * each:.3f}" for each in measured.estimate())
        rows.append((name, f"{value} ({low} to {high})", f"{1e3 * measured.least:.3f}", ratio))
    header = ("", "median (interval), ms", "least, ms", f"times as long as {ours} (interval)")
    return Table(caption, header, tuple(rows))
