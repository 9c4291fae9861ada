"""What other code does while a renderer uses CUDA, over the stand-in for libcuda; prints JSON.

Arguments: as for device_work.py. Code of producers, other threads and callbacks, and captures
of graphs come in the middle of calls.
"""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import gc
import os
import sys
import threading
import types
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.device.device_work import ADAPTER, VALIDATION, OnDevice, main, raises, same
from tests.images import picture
from vkbloom import Renderer, Separable, _core

SETTINGS = Separable()
cuda: Any = ctypes.CDLL("libcuda.so.1")
#: A stream of the host.
STREAM = ctypes.c_void_p(7)


class Running(OnDevice):
    """Runs code when it is exported."""

    def __init__(self, array: Any, code: Any):
        super().__init__(array)
        self.during = code

    def __dlpack__(self, *, stream: int | None = None) -> Any:
        self.during(stream)
        return super().__dlpack__(stream=stream)


def closing(_: Any) -> None:
    """A producer closes the renderer, or another thread does so meanwhile."""

    def here(other: Any) -> None:
        other.close()

    def beside(other: Any) -> None:
        thread = threading.Thread(target=other.close)
        thread.start()
        thread.join()

    image = picture(24, 16)
    for close in (here, beside):
        for first in (False, True):
            other: Any = Renderer(ADAPTER, validation=VALIDATION)
            kept = other.apply(OnDevice(image), SETTINGS) if first else None
            given = Running(image, lambda _, other=other, close=close: close(other))
            raises(ValueError, "the renderer is closed", lambda: other.apply(given, SETTINGS))  # noqa: B023
            del kept
            gc.collect()


def addresses(renderer: Any) -> set[int]:
    frames = renderer.apply(OnDevice(picture(24, 16)), SETTINGS)
    return {frames[name].__cuda_array_interface__["data"][0] for name in frames}


def failing(renderer: Any) -> None:
    """Memory is not used again unless CUDA tells that its last use is over."""
    used: set[int] = set()
    # An event that could be recorded is asked.
    for names in (b"cuCtxRecordEvent", b"cuEventQuery"):
        cuda.stand_in_fail(names)
        for _ in range(2):
            new = addresses(renderer)
            assert not used & new
            used |= new
    cuda.stand_in_fail(b"")
    assert used & addresses(renderer)


def short(renderer: Any) -> None:
    """The latest idle memory is kept, and is freed for new memory of another size."""
    core, size = renderer._core, 96 << 20
    part = "CUDA_ERROR_OUT_OF_MEMORY"
    # Small memory, which is kept, is freed for large memory, too.
    cuda.stand_in_fill(1)
    large = []
    with contextlib.suppress(vkbloom.OutOfMemoryError):
        while True:
            large.append(core.export(size))
    assert large
    cuda.stand_in_fill(0)
    large = [core.export(size) for _ in range(10)]
    while large:
        del large[0]
    cuda.stand_in_fill(1)
    # However large they are, but no more than eight.
    large = [core.export(size) for _ in range(8)]
    raises(vkbloom.OutOfMemoryError, part, lambda: core.export(size))
    del large
    small = core.export(1 << 20)
    cuda.stand_in_fill(0)
    assert small.address != core.export(1 << 20).address


def join(stream: int | None) -> None:
    """Make a stream wait for the captured one, as producers do."""
    event = ctypes.c_void_p()
    assert cuda.cuEventCreate(ctypes.byref(event), 2) == 0
    assert cuda.cuEventRecord(event, STREAM) == 0
    assert cuda.cuStreamWaitEvent(ctypes.c_void_p(stream), event, 0) == 0
    assert cuda.cuEventDestroy_v2(event) == 0


def captures(renderer: Any) -> None:
    """A call in a capture of a graph is an error that leaves the capture as it is."""
    image = picture(24, 16)
    wanted = renderer.apply(image, SETTINGS)
    part = "CUDA graph: the stream is being captured"
    for case in range(4):
        kept = renderer.apply(OnDevice(image), SETTINGS)
        final = kept["final"]
        cuda.stand_in_capture(STREAM)
        match case:
            case 0:  # arrays are collected, or read on the host
                del kept
                gc.collect()
                np.testing.assert_array_equal(final.numpy(), wanted["final"])
            case 1:
                given = Running(image, join)
                raises(vkbloom.Error, part, lambda: renderer.apply(given, SETTINGS))  # noqa: B023
                raises(vkbloom.Error, part, lambda: renderer.apply(OnDevice(image), SETTINGS))
                raises(vkbloom.Error, part, final.numpy)
            case 2:
                try:
                    capsule = final.__dlpack__(stream=7)
                    # Nothing is left to wait for.
                    del capsule
                except vkbloom.Error as error:
                    assert part in str(error)  # noqa: PT017
            case 3:
                torch: Any = types.ModuleType("torch")
                torch.cuda = types.SimpleNamespace(
                    is_initialized=lambda: True, is_current_stream_capturing=lambda: True
                )
                with pytest.MonkeyPatch.context() as patch:
                    patch.setitem(sys.modules, "torch", torch)
                    plain = OnDevice(image)
                    part = "PyTorch's stream is being captured"
                    raises(vkbloom.Error, part, lambda: renderer.apply(plain, SETTINGS))  # noqa: B023
        assert cuda.stand_in_capture(None), case
        same(renderer.apply(OnDevice(image), SETTINGS), wanted)


def bounds(renderer: Any) -> None:
    """Parts of memory on the device that are outside of it."""
    core, host = renderer._core, np.zeros(16, np.uint8)
    memory = core.export(100)
    start, size = memory.address, 65536  # what it is rounded up to
    source = image_at(memory, 0)
    plan = core.plan(source, SETTINGS, ("final",))
    core.run(source, (plan,), ((core.export(64),),)).wait()
    with Renderer(ADAPTER, validation=VALIDATION) as other:
        foreign = other._core.export(64)
        part = "arrays: the memory is another renderer's"
        raises(ValueError, part, lambda: core.run(source, (plan,), ((foreign,),)))
    large = core.export(2 * size)
    wide = image_at(large, 0, (128, 129, 4), (516, 4, 1))
    of_wide = core.plan(wide, SETTINGS, ("final",))
    batch = memory, 0, (4, 4, 4), (16, 4, 1), 1, 2, size
    for part, call in (
        ("a side of 0 is", lambda: memory.capsule((0, 4), 1, 8, True, 0, 0)),
        ("a side of -1 is", lambda: memory.capsule((-1,), 1, 8, True, 0, 0)),
        ("is out of range", lambda: memory.capsule((2**40, 2**40), 1, 8, True, 0, 0)),
        ("5 dimensions", lambda: memory.capsule((1,) * 5, 1, 8, True, 0, 0)),
        ("numbers of 0 bits", lambda: memory.capsule((1,), 1, 0, True, 0, 0)),
        ("outside of the memory", lambda: memory.capsule((size + 1,), 1, 8, True, 0, 0)),
        ("outside of the memory", lambda: memory.capsule((1,), 1, 8, True, size, 0)),
        ("outside of the memory", lambda: memory.capsule((1,), 1, 8, True, -1, 0)),
        ("outside of the memory", lambda: memory.clone(size, 1)),
        ("outside of the memory", lambda: memory.clone(1, -1)),
        ("at least 1", lambda: memory.clone(0, 0)),
        ("outside of the memory", lambda: memory.copy_bytes(host.ctypes.data, start, size + 1)),
        ("outside of the memory", lambda: memory.copy_bytes(start + size - 1, 0, 2)),
        ("outside of the memory", lambda: memory.copy_bytes(host.ctypes.data, start, -1)),
        ("outside of its memory", lambda: image_at(memory, size - 63)),
        ("outside of its memory", lambda: image_at(memory, -1)),
        ("outside of its memory", lambda: image_at(memory, 0, (2**32 - 1, 4, 4))),
        ("outside of its memory", lambda: image_at(memory, 0, strides=(-16, 4, 1))),
        ("outside of its memory", lambda: image_at(memory, 0, strides=(2**62, 4, 1))),
        ("outside of its memory", lambda: _core.image_source(batch)),
        ("sides of at least 1", lambda: image_at(memory, 0, (0, 4, 4))),
        ("is not 3 or 4", lambda: image_at(memory, 0, (4, 4, 2))),
        ("elements of 8 bytes", lambda: image_at(memory, 0, size=8)),
        ("arrays: memory of", lambda: core.run(wide, (of_wide,), ((memory,),))),
    ):
        raises(ValueError, part, call)


def image_at(
    memory: Any, offset: int, shape: Any = (4, 4, 4), strides: Any = (16, 4, 1), size: int = 1
) -> Any:
    return _core.image_source((memory, offset, shape, strides, size))


def callbacks(renderer: Any) -> None:
    """A callback of a stream that needs the GIL does not stop what waits for the stream."""
    image = np.zeros(1 << 16, np.uint8)
    seen: list[int] = []
    call = ctypes.CFUNCTYPE(None)(lambda: seen.append(0))
    address = image.ctypes.data
    core = renderer._core
    # A thread with the GIL that waits stops everything.
    faulthandler.dump_traceback_later(60, exit=True)

    def snapshot(of: Any) -> Any:
        cuda_call = ctypes.PyDLL("libcuda.so.1").stand_in_callback
        cuda_call(call)
        return of.snapshot(address, image.size)

    sys.setswitchinterval(10)
    try:
        memory = snapshot(core)
        del memory
        memory = snapshot(core)
        memory.complete()
        memory = memory.clone(image.size, 0)
        read = np.empty(image.size, np.uint8)
        memory.copy_bytes(read.ctypes.data, memory.address, read.nbytes)
        other: Any = Renderer(ADAPTER, validation=VALIDATION)
        with other:
            memory = snapshot(other._core)
            del memory
            memory = snapshot(other._core)
        del memory
    finally:
        sys.setswitchinterval(0.005)
    faulthandler.cancel_dump_traceback_later()
    assert len(seen) >= 4


def opening(_: Any) -> None:
    """CUDA is opened without the GIL: other threads go on."""
    call = ctypes.CFUNCTYPE(None)(lambda: None)
    faulthandler.dump_traceback_later(60, exit=True)
    sys.setswitchinterval(10)
    other: Any = Renderer(ADAPTER, validation=VALIDATION)
    try:
        cuda.stand_in_at_init(call)
        with other:
            assert other._core.cuda()[0] == 1
    finally:
        cuda.stand_in_at_init(None)
        sys.setswitchinterval(0.005)
    faulthandler.cancel_dump_traceback_later()


def lost(_: Any) -> None:
    """A renderer whose device is lost is closed, though a stream of CUDA never ends."""
    image = picture(24, 16)
    faulthandler.dump_traceback_later(60, exit=True)
    for stuck in (False, True):
        lesser = os.environ["VKBLOOM_LESSER"]
        # Validation does not know that what a lost device has got may be destroyed.
        other: Any = Renderer(ADAPTER)
        complete = other.apply(OnDevice(image), SETTINGS)["final"]
        right = complete.numpy()
        late = other.apply(OnDevice(image), SETTINGS)["final"]
        if stuck:
            cuda.stand_in_hold(1)
        os.environ["VKBLOOM_LESSER"] = f"{lesser},device"
        raises(vkbloom.DeviceLostError, "LOST", lambda: other.apply(image, SETTINGS))  # noqa: B023
        other.close()
        os.environ["VKBLOOM_LESSER"] = lesser
        # What was not signalled is not drawn, whatever the memory holds.
        raises(vkbloom.DeviceLostError, "lost", late.numpy)
        if stuck:
            raises(vkbloom.DeviceLostError, "streams of CUDA wait for it", complete.numpy)
        else:
            np.testing.assert_array_equal(complete.numpy(), right)
        del late, complete
        gc.collect()
    cuda.stand_in_hold(0)
    faulthandler.cancel_dump_traceback_later()


if __name__ == "__main__":
    main(
        (lost,)
        if "lost" in sys.argv
        else (closing, failing, short, captures, callbacks, bounds, opening)
    )
