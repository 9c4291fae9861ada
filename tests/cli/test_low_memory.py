"""Commands under a limit of address space: no crash, and messages that name memory."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.exhaustive import some
from vkbloom._grid import memory


def limited(megabytes: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a process that can map this much."""
    size = megabytes << 20
    return subprocess.run(
        [sys.executable, "-m", "vkbloom._cli", *arguments],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (size, size)),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("megabytes", some([300, 400, 500, 600, 700, 850, 1000, 1500, 2000], 3))
def test_apply_works_or_names_memory(tmp_path: Path, megabytes: int) -> None:
    source, target = tmp_path / "a.png", tmp_path / "b.png"
    vkbloom.write(source, np.full((32, 32, 3), 0.5, np.float32))
    ended = limited(megabytes, "apply", str(source), str(target))
    if ended.returncode == 0:
        assert target.is_file()
    else:
        assert ended.returncode == 1
        assert "memory is short" in ended.stderr
        assert "ulimit -v" in ended.stderr
        assert "driver." not in ended.stderr


def test_doctor_does_not_blame_the_driver() -> None:
    ended = limited(600, "doctor")
    assert ended.returncode == 1
    assert "memory is short: a limit leaves" in ended.stdout
    assert "Update its driver" not in ended.stdout
    assert "mesa-vulkan-drivers" not in ended.stdout.partition("adapters ")[2].partition("\n")[0]


def test_grids_leave_a_reserve(monkeypatch: pytest.MonkeyPatch, renderer: vkbloom.Renderer) -> None:
    image = np.zeros((16, 16, 4), np.float32)
    size = 2 * image.nbytes
    monkeypatch.setattr(memory, "memory_left", lambda: size + size // 20)
    with pytest.raises(MemoryError, match="a tenth as reserve"):
        vkbloom.grid(image, axes={"exposure": [0, 1]}, renderer=renderer)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_explore_ends_with_the_status_of_shells(number: int, status: int) -> None:
    pytest.importorskip("tornado")
    running = subprocess.Popen(
        [
            sys.executable,
            "-u",
            "-m",
            "vkbloom._cli",
            "explore",
            "--no-open",
            "--adapter",
            "software",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert running.stdout is not None
    for line in running.stdout:
        if "Ctrl-C" in line:
            running.send_signal(number)
            break
    assert running.wait(60) == status
    running.stdout.close()
