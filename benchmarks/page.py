"""The figures of docs/performance.md: results that are kept, one file a device and driver.

`keep` adds the report of a run to the results of its device. `fill` writes the tables of a page,
each between two marks, from all results. Every table names its device, date and command.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.catalogue import BENCHMARKS
from benchmarks.results import Table
from benchmarks.writing import lines_of

__all__ = ["PAGE", "RESULTS", "fill", "keep", "read_results"]

PAGE: Final = Path(__file__).resolve().parents[1] / "docs" / "performance.md"
RESULTS: Final = Path(__file__).with_name("results")
#: The name of a mark whose tables have the goals of all benchmarks.
GOALS: Final = "goals"

#: A table has so many columns more than rows.
MOST_COLUMNS: Final = 3

#: A record as JSON has it.
Record = Mapping[str, Any]

_MARKED: Final = re.compile(r"(<!-- figures of ([\w-]+) -->\n).*?(<!-- end of figures -->)", re.S)
#: What results depend on for all benchmarks; a file has one value of each.
_DEVICE: Final = ("adapter", "adapter type", "driver", "CPU", "cores")
_CLOCKS: Final = {
    "wall": "by the wall clock",
    "passes": "on the device",
    "processor": "processor time",
}


def keep(report: Path, folder: Path = RESULTS) -> Path:
    """Add the JSON file of a report to the results of its device, in place of older ones.

    Parameters
    ----------
    report : Path
    folder : Path

    Returns
    -------
    Path
        The file of the device, one for each adapter, driver and processor.

    Raises
    ------
    ValueError
        It is no report, or one of a quick run.
    OSError
    """
    try:
        found = json.loads(report.read_text(encoding="utf-8"))
        machine, sections = found["machine"], found["sections"]
        device = {name: machine[name] for name in _DEVICE}
        rows = {section["id"]: _rounded(section) for section in sections}
        about = {name: machine[name] for name in ("date", "vkbloom")}
        command = re.sub(r" --only [\w-]+", "", machine["command"])
        is_quick = "--quick" in command.split()
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{report.name} is not a result of the benchmarks") from error
    if is_quick:
        raise ValueError(f"{report.name} is of a quick run, whose figures mean nothing")
    words = [device["CPU"], device["driver"]]
    if device["adapter type"] != "cpu":
        words = [device["adapter"], device["driver"]]
    name = re.sub(r"[^a-z0-9.]+", "-", " ".join(words).lower()).strip("-")
    path = folder / f"{name}.json"
    kept: dict[str, Any] = {"device": device, "benchmarks": {}}
    if path.exists():
        kept = json.loads(path.read_text(encoding="utf-8"))
        kept["device"] = device
    for id, row in rows.items():
        # The command that runs this one alone.
        kept["benchmarks"][id] = about | {"command": f"{command} --only {id}"} | row
    folder.mkdir(parents=True, exist_ok=True)
    # Nobody reads the differences of measured figures, so they take one line.
    path.write_text(json.dumps(kept, separators=(",", ":")) + "\n", encoding="utf-8")
    return path


def _rounded(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return records and goals of a section; six digits are more than any page shows."""

    def round_all(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: round_all(each) for name, each in value.items()}
        if isinstance(value, list):
            return [round_all(each) for each in value]
        return float(f"{value:.6g}") if isinstance(value, float) else value

    wrong = [found["what"] for found in section["agreements"] if not found["agrees"]]
    found = {name: section[name] for name in ("records", "goals", "missing")}
    kept: dict[str, Any] = round_all(found | {"wrong": wrong})
    return kept


def read_results(folder: Path = RESULTS) -> list[dict[str, Any]]:
    """Return the results of all devices, GPUs last, in the order of their names."""
    found = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
    return sorted(found, key=lambda one: one["device"]["adapter type"] != "cpu")


def fill(page: str, results: Sequence[Mapping[str, Any]]) -> str:
    """Return the text of a page with the tables that the results give, between its marks.

    ValueError: a mark names no benchmark.
    """

    def tables(mark: re.Match[str]) -> str:
        start, name, end = mark.groups()
        if name != GOALS and name not in BENCHMARKS:
            raise ValueError(f"figures of {name}: there is no such benchmark")
        lines = [line for one in results for line in _of_device(name, one)]
        return "\n".join([start, *(lines or ["No result is kept.", ""]), end])

    return _MARKED.sub(tables, page)


def _of_device(name: str, results: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of one benchmark on one device; of `GOALS` those of all benchmarks."""
    device, benchmarks = results["device"], results["benchmarks"]
    if name == GOALS:
        rows = tuple(
            row for id in BENCHMARKS for row in _goals(id, benchmarks.get(id, {"goals": []}))
        )
        if rows:
            header = ("ratio", "goal", "measured (interval)", "met", "benchmark, date")
            yield f"{_title(device)}:"
            yield ""
            yield from lines_of(Table("", header, rows))
        return
    row = benchmarks.get(name)
    shown = BENCHMARKS[name].shown
    records = [] if row is None else [one for one in row["records"] if _is_shown(one, shown)]
    if not records:
        return
    clocks = {one["clock"] for one in records} - {""}
    said = f", {_CLOCKS[next(iter(clocks))]}" if len(clocks) == 1 else ""
    yield f"{_title(device)}, {row['date'].split()[0]}, `{row['command']}`{said}:"
    yield ""
    for table in _tables_of(records, many_clocks=len(clocks) > 1):
        yield from lines_of(table)
    for lacking in row["missing"]:
        yield f"- {lacking}."
    if row["missing"]:
        yield ""


def _goals(id: str, row: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for goal in row["goals"]:
        limit = f"{'at most' if goal['at_most'] else 'at least'} {goal['wanted']:.3g}"
        met = "yes" if goal["met"] else "**no**"
        yield goal["what"], limit, _text(goal["ratio"]), met, f"{id}, {row['date'].split()[0]}"


def _title(device: Mapping[str, Any]) -> str:
    if device["adapter type"] == "cpu":
        return f"**{device['CPU']}, {device['cores']} cores, {device['driver']}**"
    return f"**{device['adapter']}, {device['driver']}**"


def _is_shown(record: Record, shown: Iterable[str]) -> bool:
    return not shown or any(re.fullmatch(pattern, record["name"]) for pattern in shown)


def _tables_of(records: Sequence[Record], *, many_clocks: bool) -> Iterator[Table]:
    """Yield tables of groups that have the same contenders.

    A row is a group; where contenders are many more than groups, it is one of these.
    """
    contenders: dict[str, tuple[str, ...]] = {}
    for one in records:
        contenders[one["group"]] = (*contenders.get(one["group"], ()), one["name"])
    for names in dict.fromkeys(contenders.values()):
        groups = [group for group, found in contenders.items() if found == names]
        place = {(one["group"], one["name"]): one for one in records}
        rows = [[place[group, name] for name in names] for group in groups]

        def head(one: Record) -> str:
            said = f", {_CLOCKS[one['clock']]}" if many_clocks and one["clock"] else ""
            return f"{one['name']}{said}"

        if len(names) > len(groups) + MOST_COLUMNS:
            for group, row in zip(groups, rows, strict=True):
                # (The column is there even if nothing has a ratio.)
                of = next((f"times {one['of']}" for one in row if one["of"]), "")
                cells = tuple(
                    (
                        head(one),
                        f"{_text(one['value'])} {one['unit']}",
                        _text(one["ratio"]) if one["ratio"] else "",
                    )
                    for one in row
                )
                yield Table("", (group, "median (interval)", of), cells)
            continue
        heads = (
            f"{head(one)}, {'times ' + one['of'] if one['of'] else one['unit']}" for one in rows[0]
        )
        yield Table(
            "",
            ("", *heads),
            tuple(
                (group, *(_text(one["ratio"] or one["value"]) for one in row))
                for group, row in zip(groups, rows, strict=True)
            ),
        )


def _text(estimate: Sequence[float | None]) -> str:
    """Return a median and its interval, of three digits; alone if it was measured once."""
    value, low, high = (_digits(number) for number in estimate)
    return value if len({*estimate}) == 1 else f"{value} ({low} to {high})"


def _digits(number: float | None) -> str:
    if number is None:
        return "not a number"
    return f"{number:,.0f}" if abs(number) >= 1000 else f"{number:.3g}"
