"""SciPy: one-dimensional correlations along both axes, in 32-bit floats, on one thread."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import ImageBloom, rounded


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
        return rounded(np.add(single, blurred, out=blurred), picture.dtype)

    return {"SciPy": bloom}
