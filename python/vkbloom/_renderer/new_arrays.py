"""New arrays for the outputs of a plan."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom import _core
from vkbloom._renderer.device_arrays import Destination, memory_for

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Arrays of this size or more are in a renderer's pages, to which the device writes directly. For
#: smaller arrays NumPy recycles some memory.
LARGE_BYTES = 1 << 20


def array_bytes(shape: tuple[int, ...], dtype: str) -> int:
    """Return the size of an array."""
    return math.prod(shape) * np.dtype(dtype).itemsize


def new_array(core: _core.Renderer, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
    """Return an array for a framebuffer. Its content is undefined.

    A large one is in pages that its `base` owns. They are reused when the array is freed.
    """
    size = array_bytes(shape, dtype)
    if size < LARGE_BYTES:
        return np.empty(shape, dtype)
    # NumPy's type hints accept only buffers of the standard library.
    return np.ndarray(shape, dtype, buffer=core.pages(size))  # type: ignore[arg-type]


def new_memory(
    core: _core.Renderer, shape: tuple[int, ...], dtype: str, destination: Destination
) -> NDArray[Any] | _core.Exported:
    """Return an array for a framebuffer, or memory on the device."""
    if destination == "cuda":
        return memory_for(core, array_bytes(shape, dtype))
    return new_array(core, shape, dtype)


def new_arrays(
    core: _core.Renderer, plan: _core.Plan, destination: Destination = "host"
) -> tuple[NDArray[Any] | _core.Exported, ...]:
    """Return an array, or memory on the device, for each of a plan's outputs."""
    arrays: list[NDArray[Any] | _core.Exported] = []
    # Not a generator expression, for which `core` would be a cell. CPython 3.11 leaks all arguments
    # of a call if it cannot allocate a cell.
    for _, shape, dtype in plan.outputs:
        arrays.append(new_memory(core, shape, dtype, destination))
    return tuple(arrays)
