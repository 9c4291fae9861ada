"""Patterns of frame numbers, and the frames that are missing."""

import os
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from vkbloom._cli.sequences import check_targets, expand
from vkbloom._io.numbered_files import as_frames, gap_note, gaps, missing_count, pattern_of

NAMES = {
    "n.%04d.exr": ["n.-002.exr", "n.-001.exr", "n.0000.exr", "n.0001.exr", "n.12345.exr"],
    "n.####.exr": ["n.-002.exr", "n.-001.exr", "n.0000.exr", "n.0001.exr", "n.12345.exr"],
    "n.@@@@.exr": ["n.-002.exr", "n.-001.exr", "n.0000.exr", "n.0001.exr", "n.12345.exr"],
    "n.%d.exr": ["n.-10.exr", "n.-2.exr", "n.0.exr", "n.9.exr", "n.10.exr"],
    "n.@.exr": ["n.-10.exr", "n.-2.exr", "n.0.exr", "n.9.exr", "n.10.exr"],
    "n_#.exr": ["n_-001.exr", "n_0000.exr", "n_0001.exr"],
    "%03d.exr": ["-01.exr", "000.exr", "001.exr"],
    # The sign is padded as well, or not.
    "a.%04d.exr": ["a.-0012.exr", "a.-001.exr", "a.0002.exr"],
    # After a letter a minus sign separates, unless printf writes it there.
    "f%04d.exr": ["f-012.exr", "f0001.exr"],
    "f-%04d.exr": ["f-0007.exr", "f-0008.exr"],
    "shot1.%02d.v2.jp2": ["shot1.01.v2.jp2", "shot1.02.v2.jp2"],
}
OTHERS = ["n.1a.exr", "n.exr", "n.--1.exr", "f-0012.exr", "n.-000.exr", "n.٠٠٠١.exr"]


@pytest.mark.parametrize("pattern", NAMES)
def test_files_of_a_pattern(tmp_path: Path, pattern: str) -> None:
    for name in [*NAMES[pattern], *(name for name in OTHERS if pattern[0] == "n" == name[0])]:
        (tmp_path / name).touch()
    (tmp_path / "n.0005.exr").mkdir()
    found = expand(str(tmp_path / pattern))
    assert [Path(path).name for path, _ in found] == NAMES[pattern]
    numbers = [number for _, number in found]
    assert numbers == sorted(numbers, key=lambda number: number or 0)
    form = pattern_of(pattern)
    assert form is not None
    assert all(form.number_of(form.name_of(n)) == n for n in (-12345, -12, -1, 0, 1, 99, 123456))


@pytest.mark.parametrize("name", ["photo@2x.png", "c#.png", "a.png", "100%.png", "x#y@.exr"])
def test_names_that_are_no_patterns(name: str) -> None:
    assert pattern_of(name) is None


def test_two_files_of_one_number(tmp_path: Path) -> None:
    for name in ("f.1.exr", "f.01.exr"):
        (tmp_path / name).touch()
    with pytest.raises(ValueError, match=r"f\.01\.exr: f\.1\.exr has the same number, 1"):
        expand(str(tmp_path / "f.%d.exr"))


@pytest.mark.parametrize(
    ("names", "note"),
    [
        (["f.1", "f.2", "f.3"], None),
        (["f.1", "f.3"], "1 of 3 frames is missing: 2"),
        (["f.-002", "f.0001"], "2 of 4 frames are missing: -1 to 0"),
        ([f"f.{n}" for n in range(1, 20, 2)], "9 of 19 frames are missing: 2, 4, 6, 8, 10, ..."),
        (
            ["f.0", "f." + "9" * 30],
            f"{'9' * 29}8 of 1{'0' * 30} frames are missing: 1 to {'9' * 29}8",
        ),
        # Without one number that varies, nothing is known.
        (["a.1", "b.3"], None),
        (["a.1.1", "a.2.2"], None),
        (["f.png", "f.1.png"], None),
        (["f.1"], None),
    ],
)
def test_gaps(names: list[str], note: str | None) -> None:
    files = as_frames([(name, None) for name in names])
    assert gap_note(files) == note
    assert (missing_count(files) > 0) == bool(gaps(files)) == (note is not None)


def test_files_of_a_glob_are_in_the_order_of_their_numbers() -> None:
    files = [(f"in/f{number}_v2.jp2", None) for number in (10, 2, 9)]
    assert as_frames(files) == [(f"in/f{number}_v2.jp2", number) for number in (2, 9, 10)]


def test_targets_are_checked_in_linear_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    work = [
        (str(tmp_path / "in" / f"{n}.png"), str(tmp_path / "out" / f"{n}.png")) for n in range(300)
    ]
    for names in work:
        for name in names:
            Path(name).touch()
    calls: list[object] = []
    original = os.stat

    def stat(*arguments: Any, **more: Any) -> os.stat_result:
        calls.append(arguments)
        return original(*arguments, **more)

    monkeypatch.setattr(os, "stat", stat)
    check_targets(work, str(tmp_path / "out"), overwrite=False)
    assert len(calls) < 10 * len(work)
    os.remove(work[7][1])
    os.link(work[250][0], work[7][1])
    with pytest.raises(click.UsageError, match=r"out/7\.png: is read as IN"):
        check_targets(work, str(tmp_path / "out"), overwrite=False)


def test_apply_names_missing_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for number in ("-002", "0000"):
        vkbloom.write(f"n.{number}.exr", np.full((8, 8, 3), 2, np.float32))
    done = run("apply", "n.####.exr", "out/m.%02d.exr")
    assert done.exit_code == 0, done.stderr
    assert "note: n.####.exr: 1 of 3 frames is missing: -1\n" in done.stderr
    assert sorted(path.name for path in Path("out").iterdir()) == ["m.-2.exr", "m.00.exr"]
