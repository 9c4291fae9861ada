"""The methods of this folder in NumPy: ``load_method(file, reference=references.forty_lines)``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._settings.settings import Settings
from vkbloom.reference import _sampling as sampling

Array = NDArray[np.float64]


def glow(image: Array) -> Array:
    """Return what glows, without a threshold: the colours, with alpha 1."""
    return np.dstack([image[..., :3], np.ones(image.shape[:2])])


def shift(image: Array, right: int, down: int) -> Array:
    """Return the pixels at a distance, clamped to the edge."""
    height, width = image.shape[:2]
    rows = np.clip(np.arange(height) + down, 0, height - 1)
    columns = np.clip(np.arange(width) + right, 0, width - 1)
    return image[rows][:, columns]


def forty_lines(image: Array, settings: Settings) -> dict[str, Any]:
    """Return the framebuffers of forty_lines.hook."""
    source = glow(image)
    height, width = source.shape[:2]
    size = int(width / 2 + 0.5), int(height / 2 + 0.5)
    spread = settings.value_of("spread")
    weights = {i: np.exp(-0.5 * i * i / spread**2) for i in range(-12, 13)}
    total = sum(weights.values())
    half = sampling.sample(source, size)
    rows = sum(w * shift(half, i, 0) for i, w in weights.items()) / total
    columns = sum(w * shift(rows, 0, i) for i, w in weights.items()) / total
    bloom = sampling.sample(columns, (width, height))
    return {"half": half, "rows": rows, "bloom": bloom}


def karis(image: Array, settings: Settings) -> dict[str, Any]:
    """Return the framebuffers of karis.hook."""
    source = glow(image)
    height, width = source.shape[:2]
    size = int(width / 2 + 0.5), int(height / 2 + 0.5)
    rows, columns = 2 * np.arange(size[1]), 2 * np.arange(size[0])
    sums: Any = 0.0
    weights: Any = 0.0
    for down in (0, 1):
        for right in (0, 1):
            at = np.minimum(rows + down, height - 1), np.minimum(columns + right, width - 1)
            colour = source[at[0]][:, at[1]][..., :3]
            weight = 1 / (1 + colour @ np.array([0.2126, 0.7152, 0.0722]))[..., None]
            sums, weights = sums + weight * colour, weights + weight
    small = np.dstack([sums / weights, np.ones(size[::-1])])
    return {"small": small, "bloom": sampling.sample(small, (width, height))}


def streak(image: Array, settings: Settings) -> dict[str, Any]:
    """Return the framebuffers of streak.hook."""
    source, fade = glow(image), settings.value_of("fade")
    near = sum(0.5 * fade**i * shift(source, side * i, 0) for i in range(8) for side in (-1, 1)) * (
        1 - fade
    )
    bloom = sum(
        0.5 * fade ** (8 * i) * shift(near, 8 * side * i, 0) for i in range(4) for side in (-1, 1)
    )
    return {"near": near, "bloom": bloom}


def compute(image: Array, settings: Settings) -> dict[str, Any]:
    """Return the framebuffers of compute.hook."""
    source = glow(image)
    steps = range(-2, 3)
    return {"bloom": sum(shift(source, x, y) for y in steps for x in steps) / 25}
