"""CV-CUDA: its Gaussian and its Conv2D, in 32-bit floats, since they have no halves."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import GpuWork
from benchmarks.peers.cupy import find_cupy, time_by_events


def gpu_bloom(
    image: NDArray[np.float16], kernel: NDArray[np.float32], threshold: float
) -> dict[str, GpuWork]:
    """Return the bloom of an image (H, W, 4) by Conv2D, also alone, and a Gaussian alone.

    Conv2D has the product of both kernels. The Gaussian has as many taps.
    """
    cupy = find_cupy()
    cvcuda = importlib.import_module("cvcuda")
    source = cupy.asarray(image)
    single = source.astype(np.float32)
    weights = cupy.asarray([*REC709, 0.0], np.float32)
    product = cupy.asarray(np.outer(kernel, kernel).astype(np.float32)[..., None])
    anchors = cvcuda.as_tensor(cupy.full((1, 2), -1, np.int32), "NC")
    border = cvcuda.Border.REPLICATE
    kernels = cvcuda.ImageBatchVarShape(1)
    kernels.pushback(cvcuda.as_image(product, cvcuda.Format.F32))

    def glow_of() -> Any:
        return cupy.where((single @ weights > threshold)[..., None], single, np.float32(0))

    def convolve(glow: Any) -> Any:
        images = cvcuda.ImageBatchVarShape(1)
        images.pushback(cvcuda.as_image(glow, cvcuda.Format.RGBAf32))
        (result,) = cvcuda.conv2d(images, kernels, anchors, border, stream=stream)
        return cupy.asarray(result.cuda()).reshape(glow.shape)

    def bloom() -> Any:
        return (single + convolve(glow_of())).astype(np.float16)

    glow = glow_of()
    stream = cvcuda.as_stream(cupy.cuda.get_current_stream())
    tensor = cvcuda.as_tensor(glow, "HWC")
    taps, sigma = (len(kernel),) * 2, (len(kernel) / 4,) * 2

    def gaussian() -> Any:
        return cvcuda.gaussian(tensor, taps, sigma, border, stream=stream)

    return {
        "CV-CUDA Conv2D": time_by_events(cupy, bloom),
        "CV-CUDA Conv2D, blur alone": time_by_events(cupy, lambda: convolve(glow)),
        "CV-CUDA Gaussian, blur alone": time_by_events(cupy, gaussian),
    }
