"""Sizes of the levels of a mip chain."""

from __future__ import annotations

import math
from typing import Any, Final

#: The widest level of a method that gives its levels a height and the aspect of the frame.
WIDEST_LEVEL: Final = 16384


def size_of(image: Any) -> tuple[int, int]:
    """Return width and height of an image."""
    return image.shape[1], image.shape[0]


def halved(size: tuple[int, int], more: int = 0) -> tuple[int, int]:
    """Return half of a size, each side floored but at least 1; `more`: 1 to round up."""
    return max(1, (size[0] + more) // 2), max(1, (size[1] + more) // 2)


def scaled(size: tuple[int, int], scale: float) -> tuple[int, int]:
    """Return a size times a factor, each side floored but at least 1."""
    return max(1, math.floor(size[0] * scale)), max(1, math.floor(size[1] * scale))


def level_sizes(size: tuple[int, int], levels: int) -> list[tuple[int, int]]:
    """Return the sizes of the levels below an image, largest first.

    Each level has half the size of the one before (`halved`). The chain ends before a level of
    1 x 1, except that it always has one level.
    """
    sizes: list[tuple[int, int]] = []
    for _ in range(levels):
        size = halved(size)
        if sizes and size == (1, 1):
            break
        sizes.append(size)
    return sizes
