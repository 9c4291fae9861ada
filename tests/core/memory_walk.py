"""Refuse each of Python's own allocations in a frame once; print how many there were.

A small frame, and one whose array is in pages of the renderer's.

CPython's tests can tell its allocators to fail from the n-th request on. A frame is planned, run
and waited for with one request refused: it raises MemoryError or does without, no block of the core
is left, and the next frame is exact. Runs over a core built with VKBLOOM_FAULTS.
"""

from __future__ import annotations

import _testcapi  # type: ignore[import-not-found]
import contextlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.core.fault_walk import SIZE, core, open_renderer
from tests.images import picture
from vkbloom import Renderer, Separable
from vkbloom._renderer.new_arrays import new_arrays
from vkbloom._renderer.requests import name_outputs

BEYOND = 40  # a frame that does without one refused block may stop at the next


def collect(renderer: Renderer, image: NDArray[Any], n: int) -> tuple[bool, dict[str, Any] | None]:
    """Return whether request n was refused (0: refuse none), and the frame; None after an error."""
    settings = Separable()
    result = submission = None
    failed = False
    if n:
        _testcapi.set_nomemory(n - 1, n)
    try:
        source = core.image_source(image)
        plan = renderer._core.plan(source, settings, ("glow", "final"))
        arrays = new_arrays(renderer._core, plan)
        submission = renderer._core.run(source, (plan,), (arrays,), True)
        frame = name_outputs(plan, arrays)
        submission.wait()
        result = frame
    except MemoryError:
        failed = True
    finally:
        _testcapi.remove_mem_hooks()
    if failed and submission is not None:
        # Otherwise the renderer keeps its blocks until a later call finds it finished.
        with contextlib.suppress(RuntimeError):  # it was waited for
            submission.wait()
    return failed, result


def walk(image: NDArray[Any]) -> tuple[int, int]:
    """Walk until as many requests as BEYOND in a row were not refused; return both counts."""
    with open_renderer() as renderer:
        # Two at once, as below: with the pages of both.
        frames = [collect(renderer, image, 0)[1] for _ in range(2)]
        frame = frames.pop()
        assert frame is not None
        right = {name: array.copy() for name, array in frame.items()}
        frames, frame = [], None
        before = core.fault_state()[2]
        refused = beyond = n = 0
        while beyond < BEYOND:
            n += 1
            failed, result = collect(renderer, image, n)
            refused += failed
            beyond = 0 if failed else beyond + 1
            for frame in (result, collect(renderer, image, 0)[1]):
                if frame is not None:
                    for name, array in right.items():
                        np.testing.assert_array_equal(frame[name], array)
            frame = result = None
            assert core.fault_state()[2] == before, (n, core.fault_state())
    return n - BEYOND, refused


def main() -> None:
    """Walk both frames, and print the counts of both together."""
    walks = [walk(picture(*SIZE)), walk(picture(512, 300))]
    requests, refused = (sum(counts) for counts in zip(*walks, strict=True))
    print(f"{requests} requests of memory, {refused} raised MemoryError")


if __name__ == "__main__":
    main()
