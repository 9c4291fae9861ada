"""Frames with a moving surface in front of a background, with their motion and depth."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Frame(NamedTuple):
    """An image, and what belongs to it."""

    image: NDArray[np.float32]
    motion: NDArray[np.float32]
    depth: NDArray[np.float32]

    def keywords(self) -> dict[str, Any]:
        return {"motion": self.motion, "depth": self.depth}


def moving_frame(
    number: int, height: int, width: int, *, nearest: float, channels: int = 3
) -> Frame:
    """Return a frame of a disc that moves over a background, which moves more slowly.

    `nearest`: Whether near surfaces have a depth of 1 or 0.
    """
    rows, columns = np.mgrid[:height, :width] + 0.5
    speeds = np.array([[0.31, -0.17], [1.4, 0.6]])
    textures = []
    for speed, period in zip(speeds, (7.0, 3.1), strict=True):
        x, y = columns - number * speed[0], rows - number * speed[1]
        # Channels differ, since boxes of chromas near 0 depend on the last digits of floats.
        waves = [
            np.sin(x / period + phase) * np.cos(y / (period + 1))
            + np.sin(0.37 * x + 0.21 * y - phase)
            for phase in (0.0, 0.9, 2.1)
        ]
        textures.append(2.0 ** np.stack(waves, axis=-1))
    centre = np.array([0.35 * width, 0.4 * height]) + number * speeds[1]
    away = np.hypot(columns - centre[0], rows - centre[1])
    disc = (away < 0.28 * min(height, width))[..., np.newaxis]
    image = np.where(disc, 2 * textures[1], textures[0])
    motion = np.where(disc, speeds[1], speeds[0]) / [width, height]
    # Depths differ everywhere, so that no order of comparisons decides.
    slope = 0.001 * (columns / width + 0.37 * rows / height)
    depth = np.where(disc[..., 0], 0.8, 0.3) + slope
    if channels == 4:
        alpha = np.full((height, width, 1), 0.5)
        image = np.concatenate([image, alpha], axis=-1)
    return Frame(
        image.astype(np.float32),
        motion.astype(np.float32),
        (depth if nearest else 1 - depth).astype(np.float32),
    )
