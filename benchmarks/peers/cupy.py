"""CuPy: cupyx.scipy.ndimage, a CUDA kernel written for this bloom, and plain copies."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import COPY, GpuWork

#: Output pixels of a thread block of fused.cu, and rows for each thread.
TILE = (64, 32)
STRIP = 8


def find_cupy() -> Any:
    """Return the module; RuntimeError: it finds no device."""
    cupy = importlib.import_module("cupy")
    if cupy.cuda.runtime.getDeviceCount() == 0:
        raise RuntimeError("CuPy finds no CUDA device")
    return cupy


def time_by_events(cupy: Any, work: Any) -> GpuWork:
    """Return work on the device, timed by events."""

    def call(_: int) -> Any:
        start, end = cupy.cuda.Event(), cupy.cuda.Event()
        start.record()
        result = work()
        end.record()
        end.synchronize()
        return result, start, end

    def seconds(result: Any) -> float:
        return float(cupy.cuda.get_elapsed_time(result[1], result[2])) * 1e-3

    def fetch(result: Any) -> NDArray[Any]:
        picture: NDArray[Any] = cupy.asnumpy(result[0])
        return picture

    return GpuWork(call, seconds, fetch)


def gpu_bloom(
    image: NDArray[np.float16], kernel: NDArray[np.float32], threshold: float
) -> dict[str, GpuWork]:
    """Return blooms of an image (H, W, 4) on the GPU, each also with its blur alone."""
    cupy = find_cupy()
    ndimage = importlib.import_module("cupyx.scipy.ndimage")
    source = cupy.asarray(image)
    weights = cupy.asarray(kernel)
    brighter = cupy.ElementwiseKernel(
        "raw float16 image, float32 threshold",
        "float16 glow",
        f"""
        const auto pixel = i / 4 * 4;
        const float luminance = {REC709[0]}f * float(image[pixel])
            + {REC709[1]}f * float(image[pixel + 1]) + {REC709[2]}f * float(image[pixel + 2]);
        glow = luminance > threshold ? image[i] : float16(0);
        """,
        "vkbloom_bench_brighter",
    )
    bright = cupy.empty_like(source)
    columns, rows = cupy.empty_like(source), cupy.empty_like(source)

    # gaussian_filter1d only computes weights for correlate1d, which takes any weights.
    def blur() -> Any:
        ndimage.correlate1d(bright, weights, axis=0, output=columns, mode="nearest")
        ndimage.correlate1d(columns, weights, axis=1, output=rows, mode="nearest")
        return rows

    def bloom() -> Any:
        brighter(source, np.float32(threshold), bright)
        return source + blur()

    brighter(source, np.float32(threshold), bright)
    fused = _run_fused(cupy, source, kernel, threshold)
    return {
        "cupyx correlate1d twice": time_by_events(cupy, bloom),
        "cupyx correlate1d twice, blur alone": time_by_events(cupy, blur),
        "a CUDA kernel of our own": time_by_events(cupy, fused),
    }


def _run_fused(cupy: Any, source: Any, kernel: NDArray[np.float32], threshold: float) -> Any:
    """Return the bloom of `source` by fused.cu, one kernel for all steps."""
    height, width, _ = source.shape
    radius = len(kernel) // 2
    options = (f"-DTILE_X={TILE[0]}", f"-DTILE_Y={TILE[1]}", f"-DSTRIP={STRIP}")
    code = Path(__file__).with_name("fused.cu").read_text(encoding="utf-8")
    module = cupy.RawModule(code=code, options=("--std=c++14", f"-DRADIUS={radius}", *options))
    function = module.get_function("bloom")
    half = np.ascontiguousarray(kernel[radius:], np.float32)
    weights = module.get_global("weights")
    weights.copy_from_host(half.ctypes.data, half.nbytes)
    target = cupy.empty_like(source)
    grid = (-(-width // TILE[0]), -(-height // TILE[1]))
    block = ((TILE[0] + 2 * radius) * (TILE[1] // STRIP),)
    arguments = (source, target, np.int32(width), np.int32(height), np.float32(threshold))

    def run() -> Any:
        function(grid, block, arguments)
        return target

    return run


def gpu_copy(image: NDArray[Any]) -> dict[str, GpuWork]:
    """Return a copy of an image's bytes from device memory to device memory."""
    cupy = find_cupy()
    source = cupy.asarray(image)
    target = cupy.empty_like(source)

    def copy() -> Any:
        target.data.copy_from_device_async(source.data, source.nbytes, cupy.cuda.Stream.null)
        return target

    return {COPY: time_by_events(cupy, copy)}


def transfers(image: NDArray[Any]) -> dict[str, GpuWork]:
    """Return the bare transfers of an image's bytes from and into pinned memory of the host.

    The memory is allocated once and not used otherwise. Wall-clock time.
    """
    cupy = find_cupy()
    runtime = cupy.cuda.runtime
    source = cupy.asarray(image)
    pinned = cupy.cuda.alloc_pinned_memory(source.nbytes)
    held: NDArray[Any] = np.frombuffer(pinned, image.dtype, image.size).reshape(image.shape)
    held[...] = image

    def copy(to: int, origin: int, kind: int) -> Callable[[int], float]:
        def call(_: int) -> float:
            cupy.cuda.Device().synchronize()
            start = time.perf_counter()
            runtime.memcpy(to, origin, source.nbytes, kind)
            cupy.cuda.Device().synchronize()
            return time.perf_counter() - start

        return call

    def both(turn: int) -> float:
        return upload(turn) + readback(turn)

    def fetch(_: Any) -> NDArray[Any]:
        return held.copy()

    there, here = source.data.ptr, pinned.ptr
    upload = copy(there, here, runtime.memcpyHostToDevice)
    readback = copy(here, there, runtime.memcpyDeviceToHost)
    return {
        "bare upload from pinned memory": GpuWork(upload, float, fetch),
        "bare readback into pinned memory": GpuWork(readback, float, fetch),
        "both bare transfers": GpuWork(both, float, fetch),
    }
