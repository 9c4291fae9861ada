"""Parts of a grid: disjoint, in any order, by processes that do not know of each other."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from tests.grid.grid_in_parts import render
from tests.grid.stores import contents, keys_of
from tests.images import noise
from vkbloom import check_grid
from vkbloom._grid.layout import Grid, Layout, Variable, ask
from vkbloom._grid.order import blocks
from vkbloom._grid.store import prepare

SCRIPT = "tests.grid.grid_in_parts"
ROOT = Path(__file__).resolve().parents[2]
AXES: dict[str, Any] = {"intensity": np.linspace(0, 1, 5), "blur_scale": [0.5, 1.0, 2.0, 3.0]}


def start(store: Path, *words: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-m", SCRIPT, store], stdin=subprocess.PIPE, text=True, cwd=ROOT
    )
    assert process.stdin is not None
    process.stdin.write(" ".join(words))
    process.stdin.close()
    return process


def make(store: Any, **changes: Any) -> Any:
    image = noise(16, 21, 3, dtype="float32")
    return vkbloom.grid(image, vkbloom.Separable(), AXES, store=store, progress=False, **changes)


def test_ten_parts_of_three_processes_of_which_one_is_killed(tmp_path: Path) -> None:
    parts = [f"{number}/10" for number in range(1, 11)]
    random.Random(7).shuffle(parts)
    store = tmp_path / "parts.zarr"
    queues = [parts[:3], parts[3:5], [parts[5], "killed", *parts[6:8]]]
    started = [start(store, *queue) for queue in queues]
    ended = [process.wait() for process in started]
    assert ended == [0, 0, -signal.SIGKILL]

    report = check_grid(store)
    assert not report.complete
    assert not report.problems

    for part in (*parts[6:9], parts[0]):
        render(store, part)
    assert not check_grid(store).complete
    render(store, parts[9])
    assert check_grid(store).complete
    # Removes the temporary files of killed processes.
    render(store, None)
    render(tmp_path / "whole.zarr", None)
    assert contents(store) == contents(tmp_path / "whole.zarr")


def lay_out(intensity: float) -> tuple[Grid, Layout]:
    """Return a grid and its variables, without a device."""
    grid = ask(
        np.zeros((4, 4, 3), np.uint8),
        vkbloom.Separable(intensity=intensity),
        {"exposure": np.linspace(0, 1, 8)},
        size=None,
        shading="forward",
        time=0,
        framebuffers="final",
        reduce=None,
    )
    final = Variable(("y", "x", "channel"), (4, 4, 3), np.dtype(np.uint8), {})
    return grid, Layout((0,), {"final": final}, {"adapter": "adapter", "version": "1.0"})


# Threads share the filters of warnings, so that zarr's own filter may be gone.
@pytest.mark.filterwarnings("ignore:Consolidated metadata")
@pytest.mark.parametrize("turn", range(4))
def test_a_store_is_created_at_once(tmp_path: Path, turn: int) -> None:
    """Of four calls with two grids, those of one grid go on, and the others are refused."""
    grids = (0.25, 0.5, 0.25, 0.5)
    start = threading.Barrier(4)

    def prepare_part(number: int) -> str:
        asked = lay_out(grids[number - 1])
        start.wait(60)
        try:
            prepare(keys_of(tmp_path / "a.zarr"), *asked, (1,), (number, 4), resume=True)
        except ValueError as error:
            return str(error)
        return ""

    with ThreadPoolExecutor(4) as pool:
        said = list(pool.map(prepare_part, range(1, 5)))
    assert said[0] == said[2] == "" or said[1] == said[3] == "", said
    refused = [text for text in said if "contains another grid; settings.intensity" in text]
    assert len(refused) == 2, said
    created = next(grid for grid, text in zip(grids, said, strict=True) if not text)
    for number in (1, 3) if created == 0.25 else (2, 4):
        prepare(keys_of(tmp_path / "alone"), *lay_out(created), (1,), (number, 4), resume=True)
    assert contents(tmp_path / "a.zarr") == contents(tmp_path / "alone")


def test_parts_are_disjoint_and_complete() -> None:
    shape, chunk, ranking = (7, 3, 5), (2, 3, 1), (2, 0, 1)
    every = list(blocks(shape, chunk, ranking))
    for count in (1, 2, 7, len(every), len(every) + 5):
        parts = [list(blocks(shape, chunk, ranking, (i, count))) for i in range(1, count + 1)]
        assert [block for part in parts for block in part] == every
        assert max(map(len, parts)) - min(map(len, parts)) <= 1


def test_chunks_suffice_for_all_parts(tmp_path: Path) -> None:
    store = tmp_path / "a.zarr"
    for number in range(7):
        make(store, part=(number, 8))
    # 0 is the same as 8.
    assert not check_grid(store).complete
    make(store, part=(7, 8))
    assert check_grid(store).complete
    found = make(store)
    assert check_grid(store).complete
    make(tmp_path / "whole.zarr")
    whole = make(tmp_path / "whole.zarr")
    np.testing.assert_array_equal(found["final"].values, whole["final"].values)


def test_damage_in_a_part_is_repaired_by_it_alone(tmp_path: Path) -> None:
    store = tmp_path / "a.zarr"
    for number in (1, 2, 3):
        make(store, part=(number, 4))
    files = contents(store)
    damaged = max((store / "final").glob("c.*"))
    damaged.write_bytes(b"damaged")
    for number in (1, 2, 3):
        before = contents(store)
        make(store, part=f"{number}/4")
        assert contents(store) in (before, files)
    assert contents(store) == files


def test_command_line(tmp_path: Path) -> None:
    image = tmp_path / "a.png"
    vkbloom.write(image, noise(12, 10, 3, dtype="uint8"))
    for out in ("whole", "parts"):
        words = ["grid", str(image), "-o", str(tmp_path / out), "--axis", "intensity=0:1:6"]
        for number in "20" if out == "parts" else [""]:
            more = ["--part", f"{number}/3"] if number else []
            done = run(*words, *more)
            assert done.exit_code == 0, done.output
        assert len(list((tmp_path / out).glob("*.png"))) == (4 if out == "parts" else 6)
    assert "part 3/3 of 6 points" in done.output
    done = run(*words, "--part", "1/3")
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")
    assert run(*words, "--part", "4/3").exit_code == 2
