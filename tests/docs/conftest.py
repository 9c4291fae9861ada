"""The folder in which the code and the commands of pages run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.docs.pages import ROOT, blocks
from vkbloom import write
from vkbloom._cli.check import measuring
from vkbloom.testing import FlareChart


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the files that pages name."""
    monkeypatch.chdir(tmp_path)
    # To time large frames takes three seconds.
    timed = measuring.pass_times
    monkeypatch.setattr(measuring, "pass_times", lambda one, of, _: timed(one, of, (64, 36), 1))
    photo = (np.random.default_rng(0).random((24, 32, 3)) ** 8 * 20).astype(np.float16)
    write("photo.exr", photo)
    write("photo.jpg", photo.astype(np.float32))
    np.save("picture.npy", photo)
    chart = FlareChart(size=(72, 48))
    for name, drawn, exposure in (
        ("chart", "chart", 0.7),
        ("long", "chart", 1.0),
        ("black", "black", 1.0),
    ):
        write(f"{name}.png", np.float32(exposure) * chart.draw(drawn))
    custom = ROOT / "docs" / "custom_methods.md"
    (passes,) = blocks(custom, "glsl")
    for name in ("soft.hook", "old/soft.hook", "new/soft.hook"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(passes)
    (function,) = [text for text in blocks(custom, "python") if "def soft" in text]
    Path("soft_reference.py").write_text(function)
    page = ROOT / "docs" / "frag_as_hook.md"
    for language, files in (
        ("glsl", ("small.frag", "wide.frag")),
        ("toml", ("wide.toml",)),
        ("text", ("wide.hook", "toy.hook")),
    ):
        for name, text in zip(files, blocks(page, language), strict=True):
            Path(name).write_text(text)
    for file in (ROOT / "examples" / "languages" / "glsl").iterdir():
        Path(file.name).write_text(file.read_text())
    return tmp_path
