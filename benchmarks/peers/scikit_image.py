"""scikit-image: `correlate_sparse`, its filter with a custom kernel, along both axes.

It is as fast as `gaussian`, and accepts the kernel of the forward system.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers import ImageBloom, round_to
from benchmarks.peers.scipy import glow_of


def image_bloom(
    image: NDArray[Any], kernel: NDArray[np.float32], threshold: float, threads: int
) -> dict[str, ImageBloom]:
    """Return blooms of images like `image`; `threads` is not used."""
    filters = importlib.import_module("skimage.filters")

    def bloom(picture: NDArray[Any]) -> NDArray[Any]:
        single, blurred = glow_of(picture, threshold)
        for shape in ((-1, 1, 1), (1, -1, 1)):
            blurred = filters.correlate_sparse(blurred, kernel.reshape(shape), mode="nearest")
        return round_to(np.add(single, blurred, out=blurred), picture.dtype)

    return {"scikit-image": bloom}
