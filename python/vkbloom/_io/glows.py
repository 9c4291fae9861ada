"""Files of masks and emissions, as `vkbloom.Renderer.apply` takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.narrowing import narrow


def grey_mask(pixels: NDArray[Any], file: str) -> NDArray[Any]:
    """Return the values of a mask."""
    if (pixels[..., :3] != pixels[..., :1]).any():
        raise ValueError(f"{file}: a mask must be grey, but this image has colours")
    return pixels[..., 0]


def alike(emission: NDArray[Any], image: NDArray[Any]) -> NDArray[Any]:
    """Return an emission with the channels and the dtype of an image; files may differ in both."""
    channels = image.shape[2]
    if emission.shape[2] < channels:
        alpha = np.ones((*emission.shape[:2], 1), emission.dtype)
        emission = np.concatenate([emission, alpha], axis=2)
    return narrow(emission[..., :channels], image.dtype)
