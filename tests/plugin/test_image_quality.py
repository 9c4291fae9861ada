"""The suite in examples/image_quality, copied: it finds a wrong weight of the engine."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from vkbloom import AdapterInfo

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
            "*reference: llvmpipe*; now: the engine,*",
        ]
    )
