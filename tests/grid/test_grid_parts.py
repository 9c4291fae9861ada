"""Parts of a grid: disjoint, in any order, by processes that do not know of each other."""

from __future__ import annotations

import multiprocessing
import random
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner

import vkbloom
from tests.grid.grid_in_parts import render
from tests.grid.prepared_at_once import prepare, prepare_all
from tests.grid.stores import contents
from tests.images import noise
from vkbloom import check_grid
from vkbloom._cli.program import program
from vkbloom._grid.order import blocks

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


def test_processes_create_a_store_at_once(tmp_path: Path) -> None:
    """Of four processes with two grids, those of one grid go on, and the others are refused."""
    context = multiprocessing.get_context("forkserver")
    # What all need is imported once.
    context.set_forkserver_preload(["tests.grid.prepared_at_once", "zarr"])
    start, said = context.Barrier(4), context.Queue()
    stores = [tmp_path / str(turn) for turn in range(4)]
    grids = (0.25, 0.5, 0.25, 0.5)
    processes = [
        context.Process(target=prepare_all, args=(stores, (number, 4), grid, start, said))
        for number, grid in enumerate(grids, 1)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    assert [process.exitcode for process in processes] == [0] * 4
    lines = sorted(said.get(timeout=1) for _ in range(len(stores) * len(grids)))
    for store, each in zip(stores, zip(*[iter(lines)] * 4, strict=True), strict=True):
        refused = [line for line in each if "contains another grid; settings.intensity" in line]
        assert len(refused) == 2, each
        assert refused in (list(each[:2]), list(each[2:]))
        assert all(line.endswith(": ") for line in each if line not in refused)
        own, alone = 0.5 if refused[0] == each[0] else 0.25, tmp_path / f"{store.name} alone"
        for number in (1, 3) if own == 0.25 else (2, 4):
            prepare(alone, (number, 4), own, threading.Barrier(1))
        assert contents(store) == contents(alone)


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
            done = CliRunner().invoke(program, [*words, *more])
            assert done.exit_code == 0, done.output
        assert len(list((tmp_path / out).glob("*.png"))) == (4 if out == "parts" else 6)
    assert "part 3/3 of 6 points" in done.output
    done = CliRunner().invoke(program, [*words, "--part", "1/3"])
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")
    assert CliRunner().invoke(program, [*words, "--part", "4/3"]).exit_code == 2
