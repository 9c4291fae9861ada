"""OpenCV, with buffers that are kept between calls; only the result is new."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.inputs import REC709
from benchmarks.peers import ImageBloom


def _opencv(threads: int) -> Any:
    cv2 = importlib.import_module("cv2")
    cv2.setNumThreads(threads)
    return cv2


def image_bloom(
    image: NDArray[Any], kernel: NDArray[np.float32], threshold: float, threads: int
) -> dict[str, ImageBloom]:
    """Return blooms of images like `image`: hard luminance threshold, kernel, sum.

    Half floats are converted to 32-bit floats by OpenCV (since 4.x, by ``add`` with another depth).
    A second contender converts them with NumPy, as most programs do.
    """
    cv2 = _opencv(threads)
    if image.dtype == np.uint8:
        return {"OpenCV": _bytes_bloom(cv2, image, kernel, threshold)}
    floats = _floats_bloom(cv2, image, kernel, threshold)
    if image.dtype == np.float32:
        return {"OpenCV": lambda picture: floats(picture, cv2.CV_32F)}
    single = np.empty(image.shape, np.float32)

    def halves(picture: NDArray[Any]) -> NDArray[Any]:
        cv2.add(picture, 0, single, dtype=cv2.CV_32F)
        return floats(single, cv2.CV_16F)

    def halves_by_numpy(picture: NDArray[Any]) -> NDArray[Any]:
        np.copyto(single, picture)
        return floats(single, cv2.CV_32F).astype(np.float16)

    return {"OpenCV": halves, "OpenCV, halves by NumPy": halves_by_numpy}


def _luminance(channels: int, outputs: int) -> NDArray[np.float32]:
    """Return the matrix that writes the luminance to each of the output channels."""
    row = np.zeros(channels, np.float32)
    row[:3] = REC709
    return np.tile(row, (outputs, 1))


def _floats_bloom(
    cv2: Any, image: NDArray[Any], kernel: NDArray[np.float32], threshold: float
) -> Callable[[NDArray[Any], int], NDArray[Any]]:
    glow = np.empty(image.shape, np.float32)
    blurred = np.empty_like(glow)
    # A product with a mask of all channels is twice as fast as compare and copyTo, whose masked
    # copy uses one thread.
    luminance = _luminance(image.shape[2], image.shape[2])

    def bloom(picture: NDArray[Any], depth: int) -> NDArray[Any]:
        cv2.transform(picture, luminance, glow)
        cv2.threshold(glow, threshold, 1, cv2.THRESH_BINARY, glow)
        cv2.multiply(picture, glow, glow)
        cv2.sepFilter2D(glow, -1, kernel, kernel, blurred, borderType=cv2.BORDER_REPLICATE)
        result: NDArray[Any] = cv2.add(picture, blurred, dtype=depth)
        return result

    return bloom


def _bytes_bloom(
    cv2: Any, image: NDArray[Any], kernel: NDArray[np.float32], threshold: float
) -> ImageBloom:
    grey = np.empty(image.shape[:2], np.uint8)
    mask = np.empty_like(grey)
    glow = np.empty_like(image)
    blurred = np.empty_like(image)
    luminance = _luminance(image.shape[2], 1)

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        cv2.transform(picture, luminance, grey)
        cv2.compare(grey, 255 * threshold, cv2.CMP_GT, mask)
        glow.fill(0)
        cv2.copyTo(picture, mask, glow)
        cv2.sepFilter2D(glow, -1, kernel, kernel, blurred, borderType=cv2.BORDER_REPLICATE)
        result: NDArray[Any] = cv2.add(picture, blurred)
        return result

    return bloom


def gaussian_bloom(image: NDArray[Any], sigma: float, threads: int) -> dict[str, ImageBloom]:
    """Return the sum of half-float images like `image` and their Gaussian blur."""
    cv2 = _opencv(threads)
    single = np.empty(image.shape, np.float32)
    blurred = np.empty_like(single)

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        cv2.add(picture, 0, single, dtype=cv2.CV_32F)
        cv2.GaussianBlur(single, (0, 0), sigma, blurred, borderType=cv2.BORDER_REPLICATE)
        result: NDArray[Any] = cv2.add(single, blurred, dtype=cv2.CV_16F)
        return result

    return {"OpenCV GaussianBlur": bloom}
