"""The code of docs/testing.md, and the suite in examples/image_quality, run unchanged."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vkbloom import AdapterInfo

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "testing.md"


def blocks() -> dict[str, str]:
    """Return the Python code of the guide by the file's name in its first line."""
    found = re.findall(r"```python\n# (\w+\.py)\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert len(found) == GUIDE.read_text().count("```python")
    return dict(found)


def test_guide(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, software: AdapterInfo
) -> None:
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    code = blocks()
    for name, text in code.items():
        (pytester.path / name).write_text(text)
    subprocess.run([sys.executable, "dump.py"], cwd=pytester.path, check=True)
    options = ("-p", "vkbloom", "-p", "no:cacheprovider", "-W", "error")
    tests = sum(text.count("\ndef test_") for name, text in code.items() if name != "conftest.py")
    pytester.runpytest_subprocess(*options, "--bloom-update").assert_outcomes(passed=tests)
    pytester.runpytest_subprocess(*options).assert_outcomes(passed=tests)
    # A file that the guide shows.
    folder = pytester.path / "bloom_references" / "test_saucer"
    for name in ("test_saucer.json", "test_saucer.glow.png", "test_saucer.depth.exr"):
        assert (folder / name).is_file()


SUITE = Path(__file__).resolve().parents[2] / "examples" / "image_quality"


def test_a_wrong_weight(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, software: AdapterInfo
) -> None:
    """The tests themselves, unchanged, are collected by this repository's own configuration."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    for name in ("conftest.py", "engine.py", "test_engine.py"):
        shutil.copy(SUITE / name, pytester.path)
    code = (pytester.path / "engine.py").read_text()
    assert code.count("0.054054") == 1
    (pytester.path / "engine.py").write_text(code.replace("0.054054", "0.064054"))
    options = ("-p", "vkbloom", "-p", "no:cacheprovider", "-W", "error")
    result = pytester.runpytest_subprocess(*options)
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            "*the first framebuffer that differs is blur_vertical (glow: right)",
            f"*reference: {software.name}*; now: the engine",
        ]
    )
