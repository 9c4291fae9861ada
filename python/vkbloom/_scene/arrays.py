"""Arrays of scenes: checked, and read-only."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import plain_array

#: The longest side, far above the 4096 that every Vulkan device supports. It rejects the sizes of
#: damaged images. The device's own limit is checked at upload.
MAX_SIDE: Final = 16384

#: The shape of a mip level: of a picture, or of a cube.
LevelShape: TypeAlias = Literal["(h, w, 4)", "(6, n, n, 4)"]


def check_rows(name: str, array: object, columns: int, count: int | None = None) -> NDArray[Any]:
    """Return a mesh's numbers, if they are rows of so many finite floats, and of that count."""
    if not isinstance(array, np.ndarray):
        raise TypeError(f"{name}: {type(array).__name__} is not an array")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: {array.dtype} is not float32")
    rows = "N" if count is None else str(count)
    if array.ndim != 2 or array.shape[1] != columns or count not in (None, len(array)):
        raise ValueError(f"{name}: shape {array.shape} is not ({rows}, {columns})")
    if not len(array):
        raise ValueError(f"{name}: there are none; a mesh has at least a triangle")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: some numbers are not finite")
    return array


def check_indices(array: object, vertex_count: int) -> NDArray[Any]:
    """Return the indices of a mesh's triangles, if they are of its vertices."""
    if not isinstance(array, np.ndarray):
        raise TypeError(f"indices: {type(array).__name__} is not an array")
    if array.dtype.kind not in "iu":
        raise TypeError(f"indices: {array.dtype} is not uint32")
    if array.ndim != 1 or not array.size or array.size % 3:
        raise ValueError(
            f"indices: shape {array.shape} is not (M,) with M a positive multiple of 3"
        )
    if array.min() < 0:
        raise ValueError(f"indices: {array.min()} is below 0")
    # The device reads vertices without a check.
    if array.max() >= vertex_count:
        raise ValueError(f"indices: {array.max()} is beyond the mesh's {vertex_count} vertices")
    return array


def check_levels(
    levels: object, dtypes: Sequence[np.dtype[Any] | str], shape: LevelShape = "(h, w, 4)"
) -> tuple[NDArray[Any], ...]:
    """Return the mip levels of a picture or of a cube, read-only.

    - `dtypes`: One of these is that of all levels.
    - `shape`: That of a level.
    """
    if isinstance(levels, np.ndarray) or not isinstance(levels, Sequence):
        raise TypeError(f"levels: {type(levels).__name__} is not a tuple of arrays")
    if not levels:
        raise ValueError("levels: there are none")
    checked: list[NDArray[Any]] = []
    for level in levels:
        if not isinstance(level, np.ndarray):
            raise TypeError(f"levels: {type(level).__name__} is not an array")
        dtype = checked[0].dtype if checked else level.dtype
        if level.dtype not in dtypes or level.dtype != dtype:
            raise TypeError(f"levels: {level.dtype} is not {' or '.join(map(str, dtypes))}")
        _check_level(level, checked, shape)
        checked.append(level)
    return tuple(map(read_only, checked))


def _check_level(level: NDArray[Any], before: Sequence[NDArray[Any]], shape: LevelShape) -> None:
    is_cube = shape == "(6, n, n, 4)"
    *faces, height, width, channels = level.shape if level.ndim > 2 else (0, 0, 0)
    if faces != [6] * is_cube or channels != 4 or (is_cube and height != width):
        raise ValueError(f"levels: shape {level.shape} is not {shape}")
    if not (1 <= height <= MAX_SIDE and 1 <= width <= MAX_SIDE):
        raise ValueError(f"levels: shape {level.shape} is out of range, sides of 1 to {MAX_SIDE}")
    if not before:
        return
    high, wide = before[-1].shape[-3:-1]
    if (high, wide) == (1, 1) or (height, width) != (max(1, high // 2), max(1, wide // 2)):
        raise ValueError(
            f"levels: {width} x {height} is not half of the level before, {wide} x {high}"
        )


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` as a C-contiguous array that cannot be changed.

    An array that is read-only, C-contiguous and owns its memory is returned itself. Any other is
    copied, because the base of a read-only view can still be changed.
    """
    array = plain_array(array, "array")
    flags = array.flags
    if flags.writeable or not flags.c_contiguous or not flags.owndata:
        array = array.copy(order="C")
        array.flags.writeable = False
    return array


class Constructed:
    """A dataclass that is pickled through its constructor, without what only this process has.

    NumPy pickles do not keep arrays read-only.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __reduce__(self) -> tuple[Any, ...]:
        given = (field.name for field in dataclasses.fields(self) if field.init)
        return type(self), tuple(getattr(self, name) for name in given)
