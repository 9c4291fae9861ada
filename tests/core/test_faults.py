"""Every call fails once: the error is right, nothing leaks, and the renderer can be used again.

A core is built in which the n-th Vulkan call or allocation can be made to fail; fault_walk.py walks
through all n.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import vkbloom
from tests.core import test_lesser_devices
from tests.core.builds import ROOT, core_with_faults
from tests.core.fault_walk import workloads
from tests.core.test_lesser_devices import layer  # noqa: F401  a fixture
from tests.device import stand_in
from tests.exhaustive import EXHAUSTIVE
from tests.processes import output
from vkbloom import AdapterInfo

pytestmark = pytest.mark.skipif(
    "VKBLOOM_SANITIZED" in os.environ, reason="the walk has a core of its own, without sanitizers"
)


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory, software: AdapterInfo) -> dict[str, str]:
    """The environment variables of a process with the core that fails on demand, and a stand-in for
    CUDA."""
    package = core_with_faults(tmp_path_factory.getbasetemp()) / "python"
    cuda = stand_in.build(tmp_path_factory.mktemp("cuda"))
    # Without the cache on disk, which has its own test.
    return {
        "PYTHONPATH": str(package),
        "VKBLOOM_CACHE_DIR": "",
        **stand_in.variables(cuda, software),
    }


def run(faulty: dict[str, str], walk: str, *arguments: str) -> str:
    """Return what a walk of this folder prints."""
    # A walk with stride 1 takes longer than the limit of `output`.
    command = [sys.executable, "-m", f"tests.core.{walk}", *arguments]
    environment = {**os.environ, **faulty}
    return subprocess.run(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=True
    ).stdout


def walk(faulty: dict[str, str], stride: int) -> dict[str, dict[str, Any]]:
    rows = [json.loads(line) for line in run(faulty, "fault_walk", str(stride)).splitlines()]
    return {row["workload"]: row for row in rows}


def show(rows: dict[str, dict[str, Any]], capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print("\n\nfault points: there, walked, raised, done without")
        for name, row in rows.items():
            counts = (row[key] for key in ("points", "walked", "raised", "survived"))
            print(f"{name:<32}" + "".join(f"{count:>7}" for count in counts))


def test_released_core_has_no_fault_injection() -> None:
    assert not hasattr(vkbloom._core, "arm_fault")


def test_points_of_every_workload(
    faulty: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    # All of them take about 25 minutes.
    stride = 1 if EXHAUSTIVE else 400
    rows = walk(faulty, stride)
    show(rows, capsys)
    # Not every driver has a surface without a window.
    expected = {*workloads(), "arrays on the device"}
    assert expected - {"present"} == {*rows} - {"present"}
    assert sum(row["raised"] for row in rows.values()) > 20
    for name, row in rows.items():
        if stride == 1:
            # Each point was reached, and most of them raised; closing continues after any failure.
            assert row["walked"] >= 0.6 * row["points"] > 0, name
            assert row["raised"] > 0 or name == "close", name


def test_points_where_the_host_waits_late(
    faulty: dict[str, str],
    software: AdapterInfo,
    layer: Path,  # noqa: F811
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Arrays on the device, with semaphores that CUDA shares."""
    stride = "1" if EXHAUSTIVE else "60"
    program = ("-m", "tests.core.fault_walk", stride, "arrays on the device")
    done = test_lesser_devices.run(layer, software.name, "waits", program, **faulty)
    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout)
    show({row["workload"]: row}, capsys)
    assert row["raised"] > 0


# Prints how many instances a process makes.
INSTANCES = """
from concurrent.futures import ThreadPoolExecutor
import vkbloom
from vkbloom import _core

def use(number):
    vkbloom.adapters()
    vkbloom.Renderer(validation=number % 2 == 0).close()

_core.arm_fault(0, 0, "vkCreateInstance")
with ThreadPoolExecutor(4) as pool:
    list(pool.map(use, range(40)))
print(_core.fault_state()[0])
"""


def test_instances_are_kept_for_the_next_device(
    faulty: dict[str, str], software: AdapterInfo
) -> None:
    """NVIDIA's driver 580 allows a process about 30 instances, even one after the other.

    With and without the validation layer. Each device of lavapipe that is open has its own.
    """
    devices = 4 if "llvmpipe" in software.name else 1
    assert 2 <= int(output("-c", INSTANCES, **faulty)) <= 2 * devices


# The first waits of a renderer are for probes of texels. What a failed one was for is still in use.
WAITS = """
from tests.core.fault_walk import OUT_OF_DEVICE_MEMORY, WORK, Walk, open_renderer

with open_renderer() as renderer:
    right = {name: array.copy() for name, array in WORK["grid"](renderer).items()}
walk = Walk("grid", WORK["grid"])
print([walk.work_at(n, right, OUT_OF_DEVICE_MEMORY, "vkWaitForFences") for n in (1, 2, 3)])
"""


def test_what_a_failed_wait_was_for_is_destroyed_later(faulty: dict[str, str]) -> None:
    assert output("-c", WAITS, **faulty) == "[True, True, True]\n"


# A method counts its frames. Between two of them each call of another method's frame fails.
STATE = """
import itertools
import numpy as np
import vkbloom
from tests.custom import COUNTER
from vkbloom import _core

image = np.ones((8, 8, 4), np.float32)
counter = vkbloom.load_method(COUNTER, name="counter")(format="rgba32float")
failures = 0
with vkbloom.Renderer("software") as renderer:
    sequence = renderer.map(itertools.repeat(image), counter)
    for n in itertools.count(1):
        assert next(sequence)["bloom"][0, 0, 0] == n, n
        # The second one is another new frame, with resources of its own.
        for settings in (vkbloom.Pyramid(levels=2, exposure=n / 1024), counter.replace(exposure=1)):
            _core.arm_fault(n, -2, "")
            try:
                renderer.apply(image, settings)
            except (vkbloom.Error, MemoryError):
                failures += 1
            _, failed, *_ = _core.fault_state()
            _core.arm_fault(0, 0, "")
        if not failed:
            break
print(failures > 20)
"""


def test_the_state_of_a_method_outlives_failures(faulty: dict[str, str]) -> None:
    assert output("-c", STATE, **faulty) == "True\n"


# Opens renderers until a device is refused.
MANY = """
import vkbloom
from vkbloom import _core

renderers = [vkbloom.Renderer("software") for _ in range(3)]
_core.arm_fault(1, -3, "vkCreateDevice")
try:
    vkbloom.Renderer("software")
except vkbloom.Error as error:
    print(error)
renderers.pop().close()
_core.arm_fault(1, -3, "vkCreateDevice")
try:
    vkbloom.Renderer("software")
except vkbloom.Error as error:
    print(error)
renderers.append(vkbloom.Renderer("software"))
"""


def test_the_driver_refuses_one_renderer_more(faulty: dict[str, str]) -> None:
    """NVIDIA's driver 580 refuses 100 devices at once, without a reason."""
    for count, line in zip((3, 2), output("-c", MANY, **faulty).splitlines(), strict=True):
        assert line == (
            "vkCreateDevice failed with VK_ERROR_INITIALIZATION_FAILED. Renderers open in this "
            f"process: {count}. Drivers limit their number (NVIDIA's to fewer than 100): close "
            "those that are not needed"
        )


def test_lack_of_python_memory_is_an_error(
    faulty: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    if importlib.util.find_spec("_testcapi") is None:
        pytest.skip("CPython's own tests, which can refuse it memory, are not here")
    printed = run(faulty, "memory_walk")
    with capsys.disabled():
        print(f"\n\nPython: {printed.strip()}")
    assert int(printed.split()[4]) > 10
