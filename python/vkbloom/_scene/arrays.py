"""Arrays of scenes: checked, and read-only."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

#: The longest side, far above the 4096 that every Vulkan device supports. It rejects the sizes of
#: damaged images. The device's own limit is checked at upload.
MAX_SIDE: Final = 16384


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` as a C-contiguous array that cannot be changed.

    An array that is read-only, C-contiguous and owns its memory is returned itself. Any other is
    copied, because the base of a read-only view can still be changed.
    """
    flags = array.flags
    if flags.writeable or not flags.c_contiguous or not flags.owndata:
        array = array.copy(order="C")
        array.flags.writeable = False
    return array


def checked_levels(
    levels: Iterable[Any], faces: tuple[int, ...], dtypes: tuple[np.dtype[Any], ...]
) -> tuple[NDArray[Any], ...]:
    """Return the levels of a mip chain, read-only, or raise TypeError or ValueError.

    Levels are ``(*faces, h, w, 4)`` of one dtype. h and w are halved and rounded down from level to
    level, but at least 1. The chain may end early.
    """
    chain = tuple(levels)
    if not chain:
        raise ValueError("levels: () is not a mip chain; give at least one level")
    for index, level in enumerate(chain):
        if not isinstance(level, np.ndarray) or level.dtype not in dtypes:
            kind = level.dtype if isinstance(level, np.ndarray) else type(level).__name__
            raise TypeError(
                f"levels[{index}]: {kind} is not an array of {' or '.join(map(str, dtypes))}"
            )
        first = chain[0]
        sides = first.shape[len(faces) : -1]
        if (
            len(sides) != 2
            or not 1 <= min(sides) <= max(sides) <= MAX_SIDE
            or (faces and sides[0] != sides[1])
            or first.shape != (*faces, *sides, 4)
        ):
            side = "N, N" if faces else "h, w"
            raise ValueError(
                f"levels[0]: shape {first.shape} is not ({', '.join(map(str, (*faces, side, 4)))}) "
                f"with sides of 1 to {MAX_SIDE}"
            )
        shape = (*faces, *(max(1, side >> index) for side in sides), 4)
        if (level.shape, level.dtype) != (shape, first.dtype):
            raise ValueError(
                f"levels[{index}]: {level.dtype} of shape {level.shape} is not {first.dtype} of "
                f"shape {shape}"
            )
    if len(chain) > max(sides).bit_length():
        raise ValueError(f"levels: {len(chain)} levels are out of range; the last one is 1 x 1")
    return tuple(map(read_only, chain))
