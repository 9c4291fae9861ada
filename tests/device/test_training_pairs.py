"""examples/training_pairs.py."""

from __future__ import annotations

import importlib.util
import json
import multiprocessing
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.core.builds import ROOT
from tests.processes import python

pytestmark = pytest.mark.usefixtures("kept_renderers", "software")

PATH = ROOT / "examples" / "training_pairs.py"


@pytest.fixture
def example() -> Any:
    pytest.importorskip("click")
    spec = importlib.util.spec_from_file_location("training_pairs", PATH)
    assert spec
    assert spec.loader
    module: ModuleType = importlib.util.module_from_spec(spec)
    sys.modules["training_pairs"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["training_pairs"]


def lamps() -> Any:
    image = np.full((48, 64, 3), 0.05, np.float32)
    image[20, 30] = 200
    return image


def test_a_pair(example: Any) -> None:
    pairs = example.TrainingPairs([lamps(), lamps() / 2], per_image=2, seed=3, adapter="software")
    assert len(pairs) == 4
    pair = pairs[1]
    assert list(pair) == ["clean", "glared", "glare", "mask", "settings"]
    np.testing.assert_array_equal(pair["glared"] - pair["clean"], pair["glare"])
    assert pair["mask"].dtype == bool
    assert pair["mask"].shape == (48, 64)
    assert pair["mask"].any()
    settings = vkbloom.Settings.from_json(pair["settings"])
    with vkbloom.Renderer("software") as renderer:
        again = renderer.apply(pair["clean"], settings)["final"]
    np.testing.assert_array_equal(again, pair["glared"])
    assert json.loads(pairs[0]["settings"]) != json.loads(pair["settings"])
    with pytest.raises(IndexError):
        pairs[4]


def test_the_seed_decides(example: Any) -> None:
    def first(seed: int) -> Any:
        return example.TrainingPairs([lamps()], seed=seed, adapter="software")[0]

    np.testing.assert_array_equal(first(1)["glared"], first(1)["glared"])
    assert first(1)["settings"] != first(2)["settings"]


def test_as_a_dataset_of_pytorch(example: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    data = pytest.importorskip("torch.utils.data")
    # The workers import the example by its name.
    monkeypatch.syspath_prepend(str(PATH.parent))
    monkeypatch.setenv("PYTHONPATH", str(PATH.parent))
    pairs = example.TrainingPairs([lamps()] * 3, seed=1, adapter="software")
    loader = data.DataLoader(
        pairs,
        batch_size=3,
        num_workers=1,
        multiprocessing_context=multiprocessing.get_context("spawn"),
    )
    (batch,) = loader
    assert batch["glared"].shape == (3, 48, 64, 3)
    np.testing.assert_array_equal(batch["glared"][0].numpy(), pairs[0]["glared"])


def test_the_program(tmp_path: Path) -> None:
    pytest.importorskip("OpenImageIO")
    pytest.importorskip("click")
    vkbloom.write(tmp_path / "in.exr", lamps())
    arguments = (str(tmp_path / "in.exr"), "--out", str(tmp_path / "out"), "--count", "2")
    done = python(str(PATH), *arguments, "--adapter", "software", cwd=ROOT)
    assert done.returncode == 0, done.stderr
    folders = sorted((tmp_path / "out").iterdir())
    assert len(folders) == 2
    names = ["clean.exr", "glare.exr", "glared.exr", "mask.png", "settings.json"]
    assert sorted(path.name for path in folders[0].iterdir()) == names
