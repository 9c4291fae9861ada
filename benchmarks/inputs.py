"""The input pictures of the benchmarks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

__all__ = ["COUNT", "REC709", "THRESHOLD", "picture", "pictures"]

#: A contender cycles through this many pictures, so that each differs from the one before.
COUNT = 3
#: Pixels with a higher luminance are bright.
THRESHOLD = 0.5
#: The luminance of linear colours (ITU-R BT.709).
REC709 = (0.2126, 0.7152, 0.0722)

_BRIGHTEST = 0.7
_BLOCK = 16
# Pictures have no luminance within this distance of the threshold.
_MARGIN = 0.03


def picture(size: tuple[int, int], dtype: DTypeLike, channels: int, seed: int) -> NDArray[Any]:
    """Make a picture of blocks with a slight grain, about a quarter of them bright.

    No luminance is near `THRESHOLD`, so that rounding does not decide whether a pixel is bright. No
    value is above 0.7: a pass of the forward system's kernel at strength 1.5 multiplies a flat
    picture by 1.39, and the result stays below 1 in 8 bits. So contenders that round and clamp in
    different places can be compared.

    Parameters
    ----------
    size : (int, int)
        Width and height.
    dtype : dtype
        uint8 (0 to 255), float16 or float32 (0 to 1).
    channels : {3, 4}
        Alpha is 1.
    seed : int

    Returns
    -------
    ndarray, shape (H, W, channels)
    """
    width, height = size
    rng = np.random.default_rng(seed)
    coarse = rng.random((-(-height // _BLOCK), -(-width // _BLOCK), 3), dtype=np.float32)
    grey = coarse[..., :1] * 0.9 * _BRIGHTEST
    blocks = grey + 0.05 * coarse
    colours = blocks.repeat(_BLOCK, 0)[:height].repeat(_BLOCK, 1)[:, :width]
    colours = colours * (1 - 0.05 * rng.random((height, width, 1), dtype=np.float32))
    luminance = colours @ np.array(REC709, np.float32)
    colours[np.abs(luminance - THRESHOLD) < _MARGIN] *= 0.85
    result = np.ones((height, width, channels), np.float32)
    result[..., :3] = colours
    if np.dtype(dtype) == np.uint8:
        result = np.rint(result * 255)
    return result.astype(dtype)


def pictures(size: tuple[int, int], dtype: DTypeLike, channels: int = 4) -> list[NDArray[Any]]:
    """Make `COUNT` different pictures."""
    return [picture(size, dtype, channels, seed) for seed in range(COUNT)]
