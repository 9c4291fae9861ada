"""Images that the core is given once with a plan: kernels, and the picture of dirt."""

from __future__ import annotations

import hashlib
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class CoreKernel(NamedTuple):
    """A kernel as the core reads it.

    - `pixels`: ndarray of float32, shape (h, w, 4); Linear RGB, and the mean of the three channels
      for alpha. Shape (h, w, 1) if all channels are equal.
    - `serial`: A hash of the pixels, so that a kernel that is made again is known to the device.
    - `prefilter`: min, max and mult of Unreal Engine's prefilter; no prefilter if min is above max.
    - `reach`: How far pixels that are not 0 lie from [h // 2, w // 2] at most, along x and y.
    """

    pixels: NDArray[np.float32]
    serial: int
    prefilter: tuple[float, float, float] = (1.0, 0.0, 1.0)
    reach: tuple[int, int] = (2**31 - 1, 2**31 - 1)

    @property
    def nbytes(self) -> int:
        """The bytes of the pixels."""
        return self.pixels.nbytes


def core_kernel(values: NDArray[Any]) -> CoreKernel:
    """Return the kernel of an array, shape (h, w) or (h, w, 3)."""
    pixels = values.astype(np.float32, order="C")
    if pixels.ndim == 2 or (pixels == pixels[..., :1]).all():
        pixels = pixels.reshape(*pixels.shape[:2], -1)[..., :1].copy()
    else:
        pixels = np.concatenate([pixels, values.mean(axis=2, keepdims=True)], 2, dtype=np.float32)
    return core_image(pixels)


def core_image(pixels: NDArray[Any]) -> CoreKernel:
    """Return pixels, shape (h, w, 4) or (h, w, 1), as the core reads them."""
    pixels = np.ascontiguousarray(pixels, np.float32)
    digest = hashlib.blake2b(pixels.data, digest_size=8, key=repr(pixels.shape).encode()).digest()
    # 0 and the largest number are reserved.
    serial = min(max(int.from_bytes(digest, "little"), 1), 2**64 - 2)
    return CoreKernel(pixels, serial)
