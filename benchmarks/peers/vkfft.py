"""VkFFT by pyvkfft, for CUDA, with CuPy's arrays."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import GpuWork
from benchmarks.peers.cupy import find_cupy, time_by_events

_GLOW = f"""
const int x = i % w, y = i / w % h, channel = i / (w * h);
const bool inside = x < width && y < height;
const size_t pixel = 4 * (size_t(y) * width + x);
const float luminance = inside ? {REC709[0]}f * float(image[pixel])
    + {REC709[1]}f * float(image[pixel + 1]) + {REC709[2]}f * float(image[pixel + 2]) : 0.0f;
plane = luminance > threshold ? float(image[pixel + channel]) : 0.0f;
"""
_SUM = """
const int channel = i % 4, x = i / 4 % width, y = i / 4 / width;
final = channel == 3 ? image[i]
    : float16(float(image[i]) + planes[(size_t(channel) * h + y) * w + x]);
"""


def gpu_convolution(
    image: NDArray[np.float16],
    kernel: NDArray[np.float32],
    padded: tuple[int, int],
    threshold: float,
) -> dict[str, GpuWork]:
    """Return the bloom of an image (H, W, 4) by Fourier transforms.

    The kernel (3, h, w) has its centre at [0, 0], and the padded size.
    """
    cupy = find_cupy()
    made = importlib.import_module("pyvkfft.cuda").VkFFTApp
    transform = made((3, *padded), np.float32, ndim=2, inplace=False, r2c=True)
    source = cupy.asarray(image)
    final = cupy.empty_like(source)
    planes = cupy.empty((3, *padded), np.float32)
    spectra = cupy.empty((3, padded[0], padded[1] // 2 + 1), np.complex64)
    spectrum = cupy.empty_like(spectra)
    transform.fft(cupy.asarray(kernel), spectrum)
    sizes = "int32 width, int32 height, int32 w, int32 h"
    glow = cupy.ElementwiseKernel(
        f"raw float16 image, float32 threshold, {sizes}", "float32 plane", _GLOW, "bench_glow"
    )
    add = cupy.ElementwiseKernel(
        f"raw float16 image, raw float32 planes, {sizes}", "float16 final", _SUM, "bench_sum"
    )
    numbers = image.shape[1], image.shape[0], padded[1], padded[0]

    def bloom() -> Any:
        glow(source, np.float32(threshold), *numbers, planes)
        transform.fft(planes, spectra)
        cupy.multiply(spectra, spectrum, out=spectra)
        transform.ifft(spectra, planes)
        add(source, planes, *numbers, final)
        return final

    return {"VkFFT": time_by_events(cupy, bloom)}
