"""Every script of tools/, benchmarks/ and examples/ runs, in its shortest form.

Each runs as a program in this process. Of presets and glares it finds a few, if it asks for all.
"""

from __future__ import annotations

import os
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import pytest

import vkbloom
from tests.docs.pages import ROOT

#: The arguments of a script, in a folder with `photo.exr`; a module that it cannot do without.
RUN: Final[dict[str, tuple[str, str]]] = {
    "benchmarks/grid.py": ("points", "distributed"),
    "examples/demo.py": ("--out out", "OpenImageIO"),
    "examples/gradients/glare_removal.py": ("a.png", "scipy"),
    "examples/gradients/learned.py": ("a.png", "torch"),
    "examples/gradients/recovered_psf.py": ("a.png", "scipy"),
    "tools/check_table.py": ("a.md", "click"),
    "tools/derivatives_table.py": ("a.md", "numpy"),
    "tools/docs_pictures.py": (".", "matplotlib"),
    "tools/first_apply.py": ("tutorial", "numpy"),
    "tools/fit_recovery.py": ("a.md --count 1", "scipy"),
    "tools/glare_pictures.py": (".", "OpenImageIO"),
    "tools/laws.py": ("--out a.md", "cv2"),
    "tools/line_counts.py": ("", "numpy"),
    "tools/measured_table.py": ("a.md --rounds 1", "numpy"),
    "tools/night_picture.py": ("night.jpg", "OpenImageIO"),
    "tools/photo_sheet.py": (".", "skimage"),
    "tools/preset_pictures.py": ("a.png", "OpenImageIO"),
    "tools/psf_atlas.py": (".", "matplotlib"),
    "tools/requirements.py": ("all", "numpy"),
    "tools/run_notebooks.py": ("", "nbclient"),
    "tools/soak.py": ("20", "numpy"),
    "tools/steadiness_tables.py": (".", "numpy"),
    "tools/translate_table.py": ("a.md", "scipy"),
}


class Few(Mapping[str, Any]):
    """All of a mapping by name, and the first ones as its items."""

    def __init__(self, every: Mapping[str, Any], count: int) -> None:
        self.every, self.names = every, [*every][:count]

    def __getitem__(self, name: str) -> Any:
        return self.every[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@pytest.mark.parametrize("script", RUN)
def test_a_script_runs(
    script: str, folder: Path, kept_renderers: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, needed = RUN[script]
    pytest.importorskip(needed)
    (folder / "pictures").mkdir()
    monkeypatch.setattr(vkbloom, "presets", Few(vkbloom.presets, 2))
    monkeypatch.setattr(vkbloom, "glares", Few(vkbloom.glares, 2))
    for name, value in {"GRID_SIDE": "16", "GRID_COUNTS": "2,2,2", "GRID_SINGLES": "2"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "argv", [script, *words.split()])
    monkeypatch.syspath_prepend(str((ROOT / script).parent))
    monkeypatch.syspath_prepend(str(ROOT))
    try:
        runpy.run_path(str(ROOT / script), run_name="__main__")
    except SystemExit as ended:
        assert not ended.code
