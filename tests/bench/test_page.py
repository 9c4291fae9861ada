"""The figures of docs/performance.md are those of the results that are kept, and no others."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from benchmarks import BENCHMARKS, Plan, Report, write
from benchmarks.machine import describe
from benchmarks.page import PAGE, fill, keep, read_results
from benchmarks.results import Goal, Section
from benchmarks.timing import Estimate, Times

# A number with a unit, a number with decimals, a number in the row of a table.
FIGURE = re.compile(
    r"\d[\d.,]*\s?(?:ms|s|ns|us|GB|GiB|MB|MiB|KiB|TB|%|times)\b|\d\s?%|\d+\.\d|^\|.*\d", re.M
)
MARKED = re.compile(r"<!-- figures of [\w-]+ -->.*?<!-- end of figures -->", re.S)


def by_hand(page: str) -> list[str]:
    """Return the figures of a page outside of the tables that results give, and of code."""
    for part in (MARKED, re.compile(r"```.*?```", re.S), re.compile(r"`[^`]*`")):
        page = part.sub("", page)
    return FIGURE.findall(page)


def test_the_page_is_what_the_results_give() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == fill(page, read_results()), "run python -m benchmarks --page"
    marks = re.findall(r"<!-- figures of ([\w-]+) -->", page)
    assert sorted(marks) == sorted([*BENCHMARKS, "goals"])
    assert page.count("<!-- end of figures -->") == len(marks)


def test_no_figure_of_the_page_is_by_hand() -> None:
    assert by_hand(PAGE.read_text(encoding="utf-8")) == []
    for text in ("takes 15 ms", "a ratio of 1.3", "| `Separable` | 12 |", "at most 15 % of it"):
        assert by_hand(text), text
    # Versions and sizes of code are no figures.
    assert by_hand("`Mesa 25.0.7`, float16, 5 levels\n```\n1.5 ms\n```\n") == []


def report(path: Path, *seconds: float, driver: str = "1.0", **changes: Any) -> Path:
    """Write a report of the benchmark image with one group."""
    machine = describe(Plan(only=("image",)), None) | {
        "adapter": "A GPU",
        "adapter type": "discrete",
        "driver": driver,
        "date": "2026-11-29 07:00 UTC",
    }
    section = Section("image", "A title", missing=["CuPy is not installed"])
    times = {"vkbloom": Times((1e-3, 2e-3, 4e-3)), "OpenCV": Times(seconds)}
    section.add_times("float16", times, {"vkbloom": "passes", "OpenCV": "wall"}, "vkbloom")
    section.goals.append(Goal("x / y", Estimate(2.0, 1.5, 2.5), 1.0, at_most=True))
    write(Report(machine | changes, (section,)), path)
    return path.with_suffix(".json")


TEXT = "Before\n<!-- figures of image -->\nold\n<!-- end of figures -->\nAfter\n"


def test_results_are_kept_one_file_a_device_and_driver(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    kept = keep(report(tmp_path / "a.md", 2e-3, 8e-3, 4e-3), folder)
    assert kept.name == "a-gpu-1.0.json"
    page = fill(TEXT, read_results(folder))
    lines = page.splitlines()
    command = "`python -m benchmarks --only image`"
    assert f"**A GPU, 1.0**, 2026-11-29, {command}:" in lines
    head = "|  | vkbloom, on the device, ms | OpenCV, by the wall clock, times vkbloom |"
    assert head in lines
    assert "| float16 | 2 (1 to 4) | 2 (1 to 4) |" in lines
    assert {"- CuPy is not installed.", "Before", "After"} <= {*lines}
    assert "old" not in lines
    # Written again it stays; another run takes the place of the first, another driver does not.
    assert fill(page, read_results(folder)) == page
    assert keep(report(tmp_path / "a.md", 3e-3, 6e-3, 12e-3), folder) == kept
    assert "| float16 | 2 (1 to 4) | 3 |" in fill(TEXT, read_results(folder))
    keep(report(tmp_path / "b.md", 3e-3, 6e-3, 12e-3, driver="2.0"), folder)
    assert fill(TEXT, read_results(folder)).count("**A GPU") == 2


def test_goals_that_are_missed_are_bold(tmp_path: Path) -> None:
    keep(report(tmp_path / "a.md", 2e-3, 8e-3, 4e-3), tmp_path)
    # (The report itself is no result that is kept.)
    (tmp_path / "a.json").unlink()
    page = fill(TEXT.replace("image", "goals"), read_results(tmp_path))
    assert "| x / y | at most 1 | 2 (1.5 to 2.5) | **no** | image, 2026-11-29 |" in page


def test_what_cannot_be_kept(tmp_path: Path) -> None:
    quick = report(tmp_path / "q.md", 1.0, 1.0, 1.0, command="python -m benchmarks --quick")
    with pytest.raises(ValueError, match=r"q\.json is of a quick run, whose figures mean nothing"):
        keep(quick, tmp_path)
    for text in ("", "[]", json.dumps({"machine": {}})):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(ValueError, match=r"x\.json is not a result of the benchmarks"):
            keep(tmp_path / "x.json", tmp_path)
    with pytest.raises(ValueError, match="figures of speed: there is no such benchmark"):
        fill(TEXT.replace("image", "speed"), [])
