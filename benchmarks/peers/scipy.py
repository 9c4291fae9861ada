"""SciPy in 32-bit floats: correlations along both axes on one thread, and transforms."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import ImageBloom, round_to


def glow_of(
    image: NDArray[Any], threshold: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return an image as floats in its own units, and its part brighter than `threshold`."""
    scale = 255 if image.dtype == np.uint8 else 1
    single = image.astype(np.float32, copy=False)
    luminance = np.zeros(image.shape[2], np.float32)
    luminance[:3] = REC709
    bright = single @ luminance > threshold * scale
    return single, single * bright[..., None]


def image_bloom(
    image: NDArray[Any], kernel: NDArray[np.float32], threshold: float, threads: int
) -> dict[str, ImageBloom]:
    """Return blooms of images like `image`; `threads` is not used."""
    ndimage = importlib.import_module("scipy.ndimage")

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        single, glow = glow_of(picture, threshold)
        blurred = ndimage.correlate1d(glow, kernel, axis=0, mode="nearest")
        blurred = ndimage.correlate1d(blurred, kernel, axis=1, mode="nearest", output=glow)
        return round_to(np.add(single, blurred, out=blurred), picture.dtype)

    return {"SciPy": bloom}


def convolution(
    kernel: NDArray[np.float32], padded: tuple[int, int], threshold: float, threads: int
) -> dict[str, ImageBloom]:
    """Return blooms of RGB images by Fourier transforms of so many `threads`.

    The kernel (3, h, w) has its centre at [0, 0], and the padded size.
    """
    fft = importlib.import_module("scipy.fft")
    spectrum = fft.rfft2(kernel, workers=threads)

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        single, glow = glow_of(picture, threshold)
        # Transforms of planes are faster than those of interleaved channels.
        spectra = fft.rfft2(np.ascontiguousarray(glow.transpose(2, 0, 1)), padded, workers=threads)
        spectra *= spectrum
        blurred = fft.irfft2(spectra, padded, workers=threads, overwrite_x=True)
        height, width = picture.shape[:2]
        result = single + blurred[:, :height, :width].transpose(1, 2, 0)
        return round_to(result, picture.dtype)

    return {"SciPy's transforms": bloom}
