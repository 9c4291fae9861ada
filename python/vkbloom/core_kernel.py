"""Images that the core is given once with a plan: kernels, and the picture of dirt."""

from __future__ import annotations

import itertools
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["CoreKernel", "kernel_pixels"]

_SERIALS: Final = itertools.count(1)


class CoreKernel(NamedTuple):
    """A kernel as the core reads it.

    Attributes
    ----------
    pixels : ndarray of float32, shape (h, w, 4)
        Linear RGB, and the mean of the three channels for alpha.
    serial : int
        A number that no other kernel of this process has.
    is_grey : bool
        Whether all channels are equal.
    prefilter : (float, float, float)
        min, max and mult of Unreal Engine's prefilter; no prefilter if min is above max.
    """

    pixels: NDArray[np.float32]
    serial: int
    is_grey: bool = False
    prefilter: tuple[float, float, float] = (1.0, 0.0, 1.0)


def kernel_pixels(values: NDArray[Any]) -> tuple[NDArray[np.float32], int]:
    """Return the pixels and a new serial number of an array, shape (h, w) or (h, w, 3)."""
    pixels = np.empty((*values.shape[:2], 4), np.float32)
    pixels[..., :3] = values if values.ndim == 3 else values[..., np.newaxis]
    pixels[..., 3] = values.mean(axis=2) if values.ndim == 3 else values
    return pixels, next(_SERIALS)
