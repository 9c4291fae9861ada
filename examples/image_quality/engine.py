"""The bloom of an engine, here written in NumPy: a stand-in for the frames that yours dumps.

The engine extracts what is brighter than a threshold, and blurs it with a Gaussian kernel in two
passes at full resolution. ``frames`` returns its buffers under vkbloom's names.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]

THRESHOLD = 1.0
WEIGHTS = (0.227027, 0.1945946, 0.1216216, 0.054054, 0.016216)
INTENSITY = 0.6


def frames(picture: Image) -> dict[str, Image]:
    """Return the engine's buffers, in the order in which it writes them.

    With frames of your own engine, this is
    ``{name: vkbloom.read(f"{name}.exr") for name in ("glow", ...)}``.
    """
    luminance = picture @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    glow = np.where(luminance[..., np.newaxis] > THRESHOLD, picture, np.float32(0))
    vertical = blur(glow, axis=0)
    bloom = blur(vertical, axis=1)
    final = picture + np.float32(INTENSITY) * bloom
    return {"glow": glow, "blur_vertical": vertical, "bloom": bloom, "final": final}


def blur(image: Image, axis: int) -> Image:
    """Blur along an axis; beyond the border, the border's pixels are repeated."""
    reach = len(WEIGHTS) - 1
    margins = [(reach, reach) if each == axis else (0, 0) for each in range(3)]
    padded = np.pad(image, margins, mode="edge")
    total = np.zeros_like(image)
    for offset in range(-reach, reach + 1):
        place = reach + offset
        taps = padded.take(range(place, place + image.shape[axis]), axis)
        total += np.float32(WEIGHTS[abs(offset)]) * taps
    return total
