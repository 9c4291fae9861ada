"""A process with little address space: no driver crashes, and the message says what is short."""

from __future__ import annotations

import os
import sys

import numpy as np
import pytest

from tests.device.abilities import max_side
from tests.exhaustive import some
from tests.processes import output, python
from vkbloom import AdapterInfo, Convolution, Renderer, psf

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="the limit is of Linux"),
    pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="the sanitizers need space"),
]

# Opens a renderer and applies a bloom with some MiB more than the process has.
PROGRAM = """
import resource, sys
import numpy as np
import vkbloom

taken = next(int(line.split()[1]) for line in open("/proc/self/status") if "VmSize" in line)
limit = (taken << 10) + (int(sys.argv[1]) << 20)
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
try:
    with vkbloom.Renderer("software") as renderer:
        renderer.apply(np.zeros((1080, 1920, 4), np.float32), vkbloom.Pyramid(levels=5))
    print("done")
except MemoryError as error:
    print(type(error).__name__, error)
"""
#: For the same need on every machine.
THREADS = {"LP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "1"}


@pytest.mark.parametrize("room", some([60, 200, 330, 480, 620, 735], 3))
def test_without_room_for_a_driver(software: AdapterInfo, room: int) -> None:
    """Drivers that find no memory crash, or are not found."""
    said = output("-c", PROGRAM, str(room), **THREADS)
    if "llvmpipe" not in software.name and room > 200:
        assert "OutOfMemoryError" in said or said == "done\n"
        return
    assert said.startswith(
        "OutOfMemoryError memory is short: a Vulkan driver needs 736 MiB of address space"
    ), said
    assert "ulimit -v" in said


@pytest.mark.parametrize("room", some([745, 800, 850, 900, 950, 1000], 3))
def test_without_room_for_the_frame(room: int) -> None:
    said = output("-c", PROGRAM, str(room), **THREADS)
    # Also NumPy's words, and "done" where the driver takes less.
    assert "memory is short" in said or "Unable to allocate" in said or said == "done\n", said
    if "memory is short" in said:
        assert "MiB" in said
        assert "bloom_scale" in said or "ulimit -v" in said


def test_adapters_need_no_room_for_lavapipes_threads(software: AdapterInfo) -> None:
    """Only lavapipe has them, and only once it is opened."""
    program = PROGRAM.replace(
        'with vkbloom.Renderer("software")', "assert vkbloom.adapters()\n    with None"
    )
    done = python("-c", program, "600", LP_NUM_THREADS="32", OPENBLAS_NUM_THREADS="1")
    assert "'NoneType' object does not support the context manager" in done.stderr
    said = output("-c", PROGRAM, "600", LP_NUM_THREADS="32", OPENBLAS_NUM_THREADS="1")
    assert ("a Vulkan driver needs 5056 MiB" in said) == ("llvmpipe" in software.name)


def test_with_room() -> None:
    assert output("-c", PROGRAM, "2000", **THREADS) == "done\n"


def test_adapters_without_room() -> None:
    program = PROGRAM.replace(
        'with vkbloom.Renderer("software")', "vkbloom.adapters()\n    with None"
    )
    done = python("-c", program, "200", **THREADS)
    assert done.stdout.startswith("OutOfMemoryError memory is short: "), done.stdout + done.stderr


def test_convolutions_beyond_the_adapter() -> None:
    with Renderer("software") as renderer:
        side = max_side(renderer)
        wide = np.zeros((64, side, 3), np.uint8)
        spread = Convolution(psf.gaussian(3), kernel_size=(41, 41))
        for settings in (Convolution(), spread):
            with pytest.raises(ValueError, match=r"out of this adapter's range.*or kernel_size"):
                renderer.plan(wide, settings)
