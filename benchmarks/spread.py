"""The spread of a bloom: the standard deviation of its point-spread function."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLOCK", "block_image", "spread"]

#: Side of the bright block in pixels: a texel of the smallest of five levels. So the block averages
#: over all positions of a point relative to the grid of a level.
BLOCK: Final = 32
_VALUE: Final = 64.0


def block_image(size: tuple[int, int]) -> NDArray[np.float16]:
    """Return a black picture (H, W, 4) with a bright block near its centre."""
    width, height = size
    image = np.zeros((height, width, 4), np.float16)
    left, top = ((side // 2) // BLOCK * BLOCK for side in size)
    image[top : top + BLOCK, left : left + BLOCK] = _VALUE
    return image


def spread(
    bloom: Callable[[NDArray[np.float16]], NDArray[Any]], size: tuple[int, int]
) -> tuple[float, float]:
    """Measure a blur.

    Parameters
    ----------
    bloom : callable
        Takes a picture (H, W, 4) and returns its blur alone.
    size : (int, int)
        Width and height of the picture; the blur must end well before the edges.

    Returns
    -------
    sigma : float
        Standard deviation of the point spread along x, in pixels. The variance of the block,
        (n^2 - 1) / 12, is subtracted.
    gain : float
        The sum of the blur over the sum of the picture.
    """
    image = block_image(size)
    blurred = bloom(image)[..., 0].astype(np.float64)
    total = blurred.sum()
    profile = blurred.sum(axis=0) / total
    place = np.arange(size[0])
    variance = float((profile * (place - (profile * place).sum()) ** 2).sum())
    gain = float(total / image[..., 0].sum(dtype=np.float64))
    return float(np.sqrt(variance - (BLOCK**2 - 1) / 12)), gain
