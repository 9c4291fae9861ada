"""The path of a newcomer: from the wheel to a glowing photograph, from an array to the laws.

The times are printed, not asserted.
"""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.docs.pages import ROOT, blocks

pytest.importorskip("OpenImageIO")


def test_three_commands_to_a_glowing_photo(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of README. Where wheels are in dist/, the first one installs them elsewhere."""
    (block,) = (one for one in blocks(ROOT / "README.md", "sh") if one.startswith("pip install"))
    _, *lines = block.splitlines()  # test_commands.py runs the first one
    commands = [shlex.split(line, comments=True) for line in lines]
    assert [words[0] for words in commands] == ["vkbloom", "vkbloom"]
    photo = np.full((120, 160, 3), 20, np.uint8)
    photo[40:60, 70:90] = 255
    vkbloom.write(tmp_path / "photo.jpg", photo)
    environment = {**os.environ}
    wheels = sorted(map(str, (ROOT / "dist").glob(f"vkbloom*_{platform.machine()}.whl")))
    began = time.perf_counter()
    if wheels:
        target = str(tmp_path / "site")
        options = ["--quiet", "--no-deps", "--no-index", "--target", target]
        subprocess.run([sys.executable, "-m", "pip", "install", *options, *wheels], check=True)
        environment["PYTHONPATH"] = target
    for words in commands:
        done = subprocess.run(
            [sys.executable, "-m", *words],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    seconds = time.perf_counter() - began
    with capsys.disabled():
        print(f"\nfrom {'the wheel' if wheels else 'the package'} to the photo: {seconds:.1f} s")
    before, after = (vkbloom.read(tmp_path / name) for name in ("photo.jpg", "bloom.jpg"))
    # The wall beside the lamp glows.
    assert after[50, 95].mean() > 2 * before[50, 95].mean()


def test_five_lines_from_an_array_to_the_laws(capsys: pytest.CaptureFixture[str]) -> None:
    """Those of the quick start."""
    (block,) = (
        one for one in blocks(ROOT / "docs" / "quickstart.md", "python") if "testing.report" in one
    )
    assert len([line for line in block.splitlines() if line]) <= 5
    names: dict[str, Any] = {}
    began = time.perf_counter()
    exec(compile(block, "quickstart.md", "exec"), names)
    seconds = time.perf_counter() - began
    assert "superposition" in capsys.readouterr().out
    with capsys.disabled():
        print(f"\nfrom an array to the laws: {seconds:.1f} s")
