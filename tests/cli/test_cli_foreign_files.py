"""``vkbloom apply`` of files of other programs, and files that a signal leaves unfinished."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from tests.io.parts import reread, write
from tests.io.profiles import store_png

oiio = pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")

# Ends the process while a file is written: in another thread, if there are several.
SLOW = """
import sys, time
from vkbloom import _cli
from vkbloom._io import safe_writing

def check(*_):
    print("unfinished", flush=True)
    time.sleep(120)

safe_writing.check_complete = check
sys.argv = ["vkbloom", "apply", *sys.argv[1:]]
_cli.main()
"""


apply = functools.partial(run, "apply", "--adapter", "software")


@pytest.mark.parametrize("under", [0, 255])
def test_colours_under_alpha_0_are_told(tmp_path: Path, under: int) -> None:
    pixels = np.full((48, 64, 4), under, np.uint8)
    pixels[..., 3] = 0
    pixels[20:28, 28:36] = (200, 40, 40, 255)
    path = store_png(tmp_path / "a.png", pixels)
    result = apply(path, tmp_path / "b.png")
    assert result.exit_code == 0, result.output
    assert ("where alpha is 0" in result.stderr) is (under == 255)
    assert ("(--alpha blur) leave them out" in result.stderr) is (under == 255)
    assert apply(path, tmp_path / "c.png", "--alpha", "blur").stderr == ""
    shown = reread(tmp_path / "c.png")[1][24, 32]
    assert np.abs(shown.astype(int) - (200, 40, 40, 255)).max() <= 2


@pytest.mark.parametrize("suffix", ["png", "exr"])
def test_a_signal_leaves_no_file(tmp_path: Path, suffix: str) -> None:
    store_png(tmp_path / "a.png", np.zeros((16, 16, 3), np.uint8))
    words = [sys.executable, "-c", SLOW, "a.png", f"b.{suffix}", "--adapter", "software"]
    running = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None
    assert "unfinished\n" in running.stdout
    assert len(os.listdir(tmp_path)) == 2
    running.send_signal(signal.SIGTERM)
    assert running.wait(30) == -signal.SIGTERM
    running.stdout.close()
    assert os.listdir(tmp_path) == ["a.png"]


# ``vkbloom apply`` of large and long pictures, and of half floats.


def store(path: Path, height: int, width: int) -> Path:
    values = np.random.default_rng(5).random((height, width, 3)) ** 8
    return write(path, oiio.ImageSpec(width, height, 3, "uint8"), (255 * values).astype("uint8"))


def test_half_floats(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By choice, and for large pictures of 8 bits."""
    path = store(tmp_path / "a.png", 50, 41)
    made = []
    for limit, words in ((1 << 26, ()), (1 << 26, ("--half",)), (1, ())):
        monkeypatch.setattr("vkbloom._cli.apply._HALVED", limit)
        target = tmp_path / "b.exr"
        assert apply(path, target, "--exposure", -1, *words).exit_code == 0
        made.append(vkbloom.read(target))
    single, half, large = made
    assert 0 < abs(half.astype(float) - single).max() < 2e-3
    assert np.array_equal(half, large)


@pytest.mark.parametrize("size", [(2, 32768), (32768, 2)])
def test_longer_than_an_image_of_the_device(tmp_path: Path, size: tuple[int, int]) -> None:
    path = store(tmp_path / "a.png", *size)
    result = apply(path, tmp_path / "b.png")
    assert result.exit_code == 2
    assert "is out of this adapter's range, 1 to " in result.stderr
    assert "a side; it must be smaller" in result.stderr
