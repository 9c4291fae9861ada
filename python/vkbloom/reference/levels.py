"""Sizes of the levels of a mip chain."""

from __future__ import annotations

__all__ = ["level_sizes"]


def level_sizes(size: tuple[int, int], levels: int) -> list[tuple[int, int]]:
    """Return the sizes of the levels below an image, largest first.

    Each level is the floored half of the one before, never under 1. A level whose sides are
    both 1 ends the chain and is not part of it, save where it is the first: there is always
    one level.

    Parameters
    ----------
    size : (int, int)
        Width and height of the image above the first level, in pixels.
    levels : int
        How many levels are wanted, 1 or more.

    Returns
    -------
    list of (int, int)
        Width and height of each level; 1 to `levels` entries.
    """
    sizes: list[tuple[int, int]] = []
    width, height = size
    for _ in range(levels):
        width, height = max(1, width // 2), max(1, height // 2)
        if sizes and (width, height) == (1, 1):
            break
        sizes.append((width, height))
    return sizes
