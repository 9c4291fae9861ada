"""The scripts in examples/cluster: that of one machine runs as it stands there."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import vkbloom
from tests.exhaustive import witness
from tests.processes import output

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "cluster"


@witness("its workers take 10 s; tests/grid/test_grid_cluster.py runs grids on such a cluster")
def test_on_this_machine(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    xarray = pytest.importorskip("xarray")
    for script in FOLDER.glob("*.py"):
        shutil.copy(script, tmp_path)
    package = str(Path(vkbloom.__file__).parents[1])
    output("on_this_machine.py", cwd=tmp_path, PYTHONPATH=package)
    with xarray.open_zarr(tmp_path / "local.zarr", consolidated=False) as stored:
        assert stored["final"].shape == (8, 4, 90, 160, 3)
        assert bool(stored["done"].all())
