"""Arrays on the device, over a stand-in for libcuda that maps what lavapipe exports."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.device import stand_in
from tests.device.test_watched_device import layer, run_watched  # noqa: F401  a fixture
from tests.exhaustive import EXHAUSTIVE
from vkbloom import AdapterInfo


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return stand_in.build(tmp_path_factory.mktemp("cuda"))


WORK = "tests.device.device_work"
LIMITS = "tests.device.device_limits"
#: What the layer takes from the device, the program, and the functions of it; all without.
RUNS = (
    # Layouts, batches, places, capsules, lifetimes and errors.
    ("", WORK, "validated"),
    # The same bits with timeline semaphores that CUDA shares, and calls return earlier; on an
    # adapter that is not a CPU, whose pixels are read and written as GPUs do it.
    (
        "waits,cpu",
        WORK,
        "validated layouts later histories geometries copies sequences layers places ends "
        "recycling gradients",
    ),
    *([("waits", WORK, "validated"), ("cpu", WORK, "validated")] if EXHAUSTIVE else []),
    # What exceeds the range of buffers.
    ("bands", WORK, "validated ranges"),
    ("bands,cpu", WORK, "validated ranges"),
    # Code of others that comes between: lifetimes, failures, captures of graphs and callbacks.
    ("", LIMITS, "validated"),
    ("waits", LIMITS, "validated"),
    # A device that is lost, whose memory CUDA keeps if a stream still waits for it.
    ("waits", LIMITS, "validated lost"),
    # A renderer on another GPU.
    ("missing", WORK, "validated missing"),
)


@pytest.mark.parametrize("run_of", RUNS, ids=str)
def test_arrays_on_the_device(
    folder: Path,
    software: AdapterInfo,
    layer: Path,  # noqa: F811
    run_of: tuple[str, str, str],
) -> None:
    lesser, program, words = run_of
    # Freed memory has other content, so that a use of it is found.
    variables = stand_in.variables(folder, software) | {"MALLOC_PERTURB_": "165"}
    if "missing" in words:
        variables["STAND_IN_UUID"] = "11" * 16
    # The layer objects to buffers that are acquired from CUDA before they are released to it.
    said = run_watched(layer, software, lesser, ("-m", program, *words.split()), variables)
    # Before it the validation layer says what a lost device makes right.
    said = said.splitlines()[-1] if "lost" in words else said
    assert json.loads(said) == {}
    left = (folder / "left").read_text().split()
    # Contexts, streams, events, memories, mappings, contexts that are current.
    assert "lost" in words or left[:6] == ["0"] * 6, left
