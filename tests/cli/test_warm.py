"""``vkbloom warm``: later processes find the pipelines in the caches."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import vkbloom
from tests.processes import output

APPLY = """
import numpy as np, vkbloom
with vkbloom.Renderer("software") as renderer:
    renderer.apply(np.ones((24, 32, 3), np.float32), vkbloom.presets["kino"])
"""


def files(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file() and path.suffix != ".tmp"}


@pytest.mark.skipif(os.environ.get("MESA_SHADER_CACHE_DISABLE", "") == "true", reason="cache off")
def test_a_later_process_compiles_nothing(tmp_path: Path) -> None:
    with vkbloom.Renderer("software") as renderer:
        if "Mesa" not in renderer.info.driver_info:
            pytest.skip("no Mesa")
    ours, drivers = tmp_path / "ours", tmp_path / "drivers"
    drivers.mkdir()
    cached = {"VKBLOOM_CACHE_DIR": str(ours), "MESA_SHADER_CACHE_DIR": str(drivers)}
    words = ["-m", "vkbloom", "warm", "--preset", "kino", "--type", "float32", "--size", "32x24"]
    assert "4 kinds of calls on" in output(*words, "--adapter", "software", **cached)
    filled = {path: path.stat().st_size for path in files(drivers)}
    assert filled
    assert files(ours)
    output("-c", APPLY, **cached)
    assert {path: path.stat().st_size for path in files(drivers)} == filled
