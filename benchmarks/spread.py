"""How far a bloom spreads: the standard deviation of its point-spread function."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLOCK", "block_image", "spread"]

#: Side of the bright block, a multiple of the pixels under a texel of the smallest level of five,
#: so that the mean over all places of a point is seen, and not one place in the grid of a level.
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
        Width and height at which it runs; the blur must end well before the edges.

    Returns
    -------
    sigma : float
        Standard deviation along x of what becomes of one point, in pixels; that of the block,
        sqrt((n^2 - 1) / 12), is taken out.
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
