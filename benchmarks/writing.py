"""Reports as Markdown and JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.results import Report, Section, Table
from benchmarks.timing import Estimate

__all__ = ["Earlier", "as_json", "as_markdown", "lines_of", "read_earlier", "write"]


class Earlier(NamedTuple):
    """What another report shares its table with: its driver, and the ratios of its goals."""

    driver: str
    ratios: dict[str, str]


def read_earlier(path: Path) -> Earlier:
    """Read the JSON file of a report; ValueError: it is no such file."""
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        goals = [goal for section in report["sections"] for goal in section["goals"]]
        ratios = {
            str(goal["what"]): str(Estimate(*(math.nan if n is None else n for n in goal["ratio"])))
            for goal in goals
        }
        return Earlier(str(report["machine"]["driver"]), ratios)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path.name} is not a result of the benchmarks") from error


def write(report: Report, path: Path, beside: Sequence[Earlier] = ()) -> list[Path]:
    """Write a report as Markdown, and beside it as JSON, and return both files.

    `beside`: Reports whose ratios stand beside those of this one.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    as_text = path.with_suffix(".json")
    path.write_text(as_markdown(report, beside), encoding="utf-8")
    as_text.write_text(json.dumps(as_json(report), indent=1) + "\n", encoding="utf-8")
    return [path, as_text]


def as_json(report: Report) -> dict[str, Any]:
    """Return a report as plain values, with the seconds of every round.

    NaN and infinity, which JSON does not have, become None.
    """
    sections = []
    for section in report.sections:
        values = dataclasses.asdict(section)
        values["agreements"] = [
            {**dataclasses.asdict(found), "agrees": found.agrees} for found in section.agreements
        ]
        values["goals"] = [{**dataclasses.asdict(goal), "met": goal.met} for goal in section.goals]
        values["times"] = {
            group: {
                name: {
                    "median": times.median,
                    "least": times.least,
                    "interval": times.estimate()[1:],
                    "seconds": times.seconds,
                }
                for name, times in measured.items()
            }
            for group, measured in section.times.items()
        }
        sections.append(values)
    plain: dict[str, Any] = _finite({"machine": report.machine, "sections": sections})
    return plain


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_markdown(report: Report, beside: Sequence[Earlier] = ()) -> str:
    """Return a report as a page of Markdown."""
    machine = report.machine
    lines = [f"# Benchmarks on {machine['adapter']}", ""]
    lines += [f"Written by `{machine['command']}`, {machine['date']}.", ""]
    if machine["adapter type"] == "cpu":
        lines += [
            "This adapter is a CPU: all times are wall-clock times on the same cores that the "
            "peers use. They say nothing about a GPU.",
            "",
        ]
    lines += lines_of(_machine_table(machine))
    goals = [(section.id, goal) for section in report.sections for goal in section.goals]
    if goals:
        rows = tuple(
            (
                goal.what,
                f"{'at most' if goal.at_most else 'at least'} {goal.wanted:.3g}",
                str(goal.ratio),
                "yes" if goal.met else "no",
                *(other.ratios.get(goal.what, "not measured") for other in beside),
                name,
            )
            for name, goal in goals
        )
        drivers = tuple(f"with {other.driver}" for other in beside)
        header = ("ratio (interval)", "wanted", "measured", "met", *drivers, "benchmark")
        lines += ["## Goals", "", *lines_of(Table("", header, rows))]
    for section in report.sections:
        lines += _section(section)
    return "\n".join(lines).rstrip() + "\n"


def _machine_table(machine: dict[str, Any]) -> Table:
    rows = [
        (name, "none" if value is None else str(value))
        for name, value in machine.items()
        if name not in ("date", "command", "peers")
    ]
    rows += [(name, version or "not installed") for name, version in machine["peers"].items()]
    return Table("", ("", ""), tuple(rows))


def _section(section: Section) -> list[str]:
    lines = [f"## {section.title} (`{section.id}`)", ""]
    for paragraph in section.about:
        lines += [paragraph, ""]
    for table in section.tables:
        lines += lines_of(table)
    if section.agreements:
        rows = tuple(
            (
                found.what,
                f"{found.largest:.3g}",
                f"{found.allowed:.3g}",
                "yes" if found.agrees else "**no**",
            )
            for found in section.agreements
        )
        header = ("same picture?", "largest difference", "allowed", "agrees")
        lines += lines_of(Table("", header, rows))
        reasons = dict.fromkeys(found.reason for found in section.agreements)
        lines += ["What is allowed:", "", *(f"- {reason}." for reason in reasons), ""]
    if section.missing:
        lines += ["Not run:", "", *(f"- {text}" for text in section.missing), ""]
    return lines


def lines_of(table: Table) -> list[str]:
    """Return a table as lines of Markdown."""
    lines = [f"**{table.caption}**", ""] if table.caption else []
    lines.append(f"| {' | '.join(table.header)} |")
    lines.append("|---" * len(table.header) + "|")
    lines += [f"| {' | '.join(_cell(text) for text in row)} |" for row in table.rows]
    return [*lines, ""]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
