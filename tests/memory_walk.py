"""Refuse each of Python's own allocations in a frame once; print how many there were.

CPython's tests can tell its allocators to fail from the n-th request on. The batch of a frame is
filled, submitted and collected with one request refused: it raises MemoryError or does without, no
block of the core is left, and the next frame is exact. Runs over a core built with VKBLOOM_FAULTS.
"""

from __future__ import annotations

import _testcapi  # type: ignore[import-not-found]
from typing import Any

import numpy as np
from fault_walk import SIZE, core, open_renderer, picture

from vkbloom import Renderer, Separable
from vkbloom.renderer import _allocator

BEYOND = 40  # a frame that does without one refused block may stop at the next


def collected(renderer: Renderer, n: int) -> tuple[bool, dict[str, Any] | None]:
    """Return whether request n was refused (0: none is), and the frame, or None after an error."""
    image, settings, allocate = picture(SIZE), Separable(), _allocator(renderer._core, None)
    result = None
    failed = False
    if n:
        _testcapi.set_nomemory(n - 1, n)
    try:
        batch = renderer._core.apply(image, None)
        batch.add(settings, allocate)
        batch.submit()
        result = batch.collect()[0][0]
    except MemoryError:
        failed = True
    finally:
        _testcapi.remove_mem_hooks()
    return failed, result


def main() -> None:
    """Walk until as many requests as BEYOND in a row were not refused."""
    with open_renderer() as renderer:
        _, right = collected(renderer, 0)
        assert right is not None
        before = core.fault_state()[2]
        refused = beyond = n = 0
        while beyond < BEYOND:
            n += 1
            failed, result = collected(renderer, n)
            refused += failed
            beyond = 0 if failed else beyond + 1
            for frame in (result, collected(renderer, 0)[1]):
                if frame is not None:
                    for name, array in right.items():
                        np.testing.assert_array_equal(frame[name], array)
            frame = result = None
            assert core.fault_state()[2] == before, (n, core.fault_state())
    print(f"{n - BEYOND} requests of memory, {refused} raised MemoryError")


if __name__ == "__main__":
    main()
