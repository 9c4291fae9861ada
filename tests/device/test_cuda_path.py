"""Arrays on the device, over a stand-in for libcuda that maps what lavapipe exports."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT
from tests.core.test_lesser_devices import layer, run  # noqa: F401  a fixture
from tests.device import stand_in
from tests.exhaustive import EXHAUSTIVE
from tests.processes import python
from vkbloom import AdapterInfo


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return stand_in.build(tmp_path_factory.mktemp("cuda"))


@pytest.mark.parametrize("validation", ["validated", *["plain"] * EXHAUSTIVE])
def test_all_of_it(folder: Path, software: AdapterInfo, validation: str) -> None:
    """Layouts, batches, places, capsules, lifetimes and errors (device_work.py)."""
    done = python(
        *("-m", "tests.device.device_work", validation),
        cwd=ROOT,
        **stand_in.variables(folder, software),
    )
    check(done, folder)


@pytest.mark.parametrize("lesser", ["", "waits"])
def test_code_of_others_comes_between(
    folder: Path,
    software: AdapterInfo,
    layer: Path,  # noqa: F811
    lesser: str,
) -> None:
    """Lifetimes, failures, captures of graphs and callbacks (device_limits.py)."""
    # Freed memory has other content, so that a use of it is found.
    variables = stand_in.variables(folder, software) | {"MALLOC_PERTURB_": "165"}
    program = ("-m", "tests.device.device_limits", "validated")
    check(run(layer, software.name, lesser, program, **variables), folder)


def test_a_renderer_on_another_gpu(folder: Path, software: AdapterInfo) -> None:
    variables = stand_in.variables(folder, software) | {"STAND_IN_UUID": "11" * 16}
    program = ("-m", "tests.device.device_work", "validated", "missing")
    check(python(*program, cwd=ROOT, **variables), folder)


@pytest.mark.parametrize("lesser", ["bands", "bands,cpu"])
def test_what_exceeds_the_range_of_buffers(
    folder: Path,
    software: AdapterInfo,
    layer: Path,  # noqa: F811
    lesser: str,
) -> None:
    program = ("-m", "tests.device.device_work", "validated", "ranges")
    variables = stand_in.variables(folder, software)
    check(run(layer, software.name, lesser, program, **variables), folder)


WORK = ("layouts", "sequences", "layers", "places", "gradients")


def test_dispatches_access_images(
    folder: Path,
    software: AdapterInfo,
    layer: Path,  # noqa: F811
) -> None:
    """What reads and writes pixels on an adapter that is not a CPU, as GPUs do it."""
    program = ("-m", "tests.device.device_work", "validated", *WORK)
    check(run(layer, software.name, "cpu", program, **stand_in.variables(folder, software)), folder)


@pytest.mark.parametrize("lesser", ["waits", "waits,cpu"])
def test_the_host_does_not_wait(
    folder: Path,
    software: AdapterInfo,
    layer: Path,  # noqa: F811
    lesser: str,
) -> None:
    """With timeline semaphores that CUDA shares: the same bits, and calls return earlier."""
    program = ("-m", "tests.device.device_work", "validated")
    variables = stand_in.variables(folder, software)
    check(run(layer, software.name, lesser, program, **variables), folder)


def check(done: subprocess.CompletedProcess[str], folder: Path) -> None:
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {}
    left = (folder / "left").read_text().split()
    # Contexts, streams, events, memories, mappings, contexts that are current.
    assert left[:6] == ["0"] * 6, left
