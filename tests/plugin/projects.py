"""Small projects in which pytest runs with the plugin."""

from __future__ import annotations

from pathlib import Path

import pytest

# Two framebuffers of half floats and one of 8 bits; SHIFT changes the second one.
PROJECT = """
import numpy as np
import os
import pytest

def frames(shift=float(os.environ.get("SHIFT", 0))):
    ramp = np.linspace(0, 1, 16 * 12 * 3).reshape(12, 16, 3)
    return {
        "glow": ramp.astype(np.float16),
        "bloom": (ramp / 2 + shift).astype(np.float16),
        "final": np.round(np.minimum(ramp * 1.5 + shift, 1) * 255).astype(np.uint8),
    }
"""
ONE = PROJECT + "def test_frames(frame_regression): frame_regression.check(frames())\n"


def write(project: pytest.Pytester, text: str, name: str = "test_one") -> None:
    project.makepyfile(**{name: text})


def run(project: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    """Run without other plugins, which take most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
        return project.runpytest_inprocess("-p", "no:cacheprovider", "-p", "vkbloom", *arguments)


def run_workers(project: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    """Run with two workers of xdist."""
    return run(project, "-p", "xdist", "-n", "2", *arguments)


def references(project: pytest.Pytester, module: str = "test_one") -> list[str]:
    return sorted(file.name for file in (project.path / "bloom_references" / module).iterdir())


def edit(file: Path, was: str, now: str) -> None:
    content = file.read_text()
    assert content.count(was) == 1
    file.write_text(content.replace(was, now))
