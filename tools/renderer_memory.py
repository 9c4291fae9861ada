"""Measure the memory that renderers and frames leak.

It shows the growth of the process for one repetition of each:

- ``renderer``: a `vkbloom.Renderer`, created and closed, and a list of the adapters;
- ``validated``: the same under the validation layer;
- ``frame``: a renderer with one small frame of all framebuffers;
- ``open``: one more frame of a renderer that stays open, sizes and settings changing, and a
  sequence of frames that is abandoned half way.

These are measured after a collection and a trim of the heap, as the median of several rounds:

- ``heap``: bytes in use by malloc, of all libraries and of Python (whose own allocator is turned
  off), independent of the heap's fragmentation;
- ``data``: resident bytes that are not executable, the heap with its gaps and all other mappings;
- ``code``: resident bytes of anonymous executable mappings. These are shaders compiled by
  the driver; the package makes none;
- ``descriptors`` and ``threads``.

Linux with glibc 2.33 or newer. Usage: ``python tools/renderer_memory.py [COUNT [NAME ...]]``,
COUNT renderers (default 1000, at least 100), and which of the four (default all)
"""

from __future__ import annotations

import ctypes
import gc
import itertools
import json
import os
import sys
from collections.abc import Callable

import numpy as np

import vkbloom

# One arena without thread caches, for all allocations including Python's objects, so that the bytes
# in use are exact. The software device draws in the thread that submits to it: with threads of its
# own it begins a new scene while it draws the last one, and each scene keeps blocks of 64 KiB until
# it is used again, so that what is in use depends on how fast the threads are.
ENVIRONMENT = {
    "PYTHONMALLOC": "malloc",
    "MALLOC_ARENA_MAX": "1",
    "GLIBC_TUNABLES": "glibc.malloc.tcache_count=0",
    "LP_NUM_THREADS": "0",
}

ROUNDS = 10
WARM_UP = 20
SIZES = ("heap", "data", "code", "descriptors", "threads")


class _HeapInfo(ctypes.Structure):
    """struct mallinfo2 of <malloc.h>."""

    _names = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost"
    _fields_ = tuple((name, ctypes.c_size_t) for name in _names.split())


def sizes() -> tuple[int, ...]:
    """Return the memory in use by this process, in the order of SIZES."""
    # CPython's cache of type attributes keeps up to 4096 names alive until it is cleared.
    getattr(sys, "_clear_internal_caches", sys._clear_type_cache)()
    gc.collect()
    libc = ctypes.CDLL(None)
    libc.malloc_trim(0)
    libc.mallinfo2.restype = _HeapInfo
    heap = libc.mallinfo2()
    data = code = 0
    executable = anonymous = False
    with open("/proc/self/smaps") as mappings:
        for line in mappings:
            words = line.split()
            if not words[0].endswith(":"):
                executable, anonymous = "x" in words[1], words[4] == "0"
            elif words[0] == "Rss:" and executable and anonymous:
                code += int(words[1]) * 1024
            elif words[0] == "Rss:" and not executable:
                data += int(words[1]) * 1024
    in_use = heap.uordblks + heap.hblkhd
    descriptors, threads = (len(os.listdir(f"/proc/self/{name}")) for name in ("fd", "task"))
    return in_use, data, code, descriptors, threads


def growth(
    action: Callable[[], None], count: int, settle: Callable[[], None] = lambda: None
) -> dict[str, float]:
    """Return the growth of one call, the median of ROUNDS; `count` calls in all.

    `settle` is called before each look at the sizes.
    """
    # The first calls fill caches of the loader, the driver and Python.
    for _ in range(WARM_UP):
        action()
    # Allocated before the first measurement, which must not allocate itself.
    taken = np.zeros((ROUNDS + 1, len(SIZES)))
    settle()
    taken[0] = sizes()
    for row in range(1, ROUNDS + 1):
        for _ in range(count // ROUNDS):
            action()
        settle()
        taken[row] = sizes()
    # A median, since a table of Python may grow in one of the rounds without a leak.
    middle = np.median(np.diff(taken, axis=0), axis=0) / (count // ROUNDS)
    return dict(zip(SIZES, middle.tolist(), strict=True))


def frame_growth(scene: vkbloom.Scene, count: int) -> dict[str, float]:
    """Return the growth for one more frame of a renderer that stays open, `count` of them.

    Of 200 and more, each round has all settings in all sizes, so that it ends as it began.
    """
    sizes = [(64, 36), (33, 57), (1, 1), (120, 8)]
    settings = [
        vkbloom.Separable(),
        vkbloom.Separable(blur_scale=1.5, bloom_size=(40, 30)),
        vkbloom.Separable(layers=((1.0, 1.0), (2.0, 0.5)), format="rgba16float"),
        vkbloom.Separable(loops=2, bloom_scale=0.5, direct=True, tonemap="aces"),
        vkbloom.Separable(bloom=False),
    ]
    requests = itertools.cycle(itertools.product(settings, sizes))
    times = itertools.cycle([0.0, 0.3, 0.55, 0.8])

    with vkbloom.Renderer("software") as renderer:

        def action() -> None:
            chosen, size = next(requests)
            renderer.render(scene, chosen, size, time=next(times))
            # Abandon some more, which the device has started with.
            many = renderer.sweep(scene, settings, size=size, time=next(times))
            for _ in range(3):
                next(many)

        def settle() -> None:
            # The driver keeps blocks of 64 KiB for its last images; images of one pixel need none.
            for time in range(8):
                tiny = vkbloom.Separable(bloom_size=(1, 1))
                renderer.render(scene, tiny, (1, 1), time=time / 8)

        return growth(action, count, settle)


def renderer_growth(count: int, *, validation: bool = False) -> dict[str, float]:
    """Return the growth for one more renderer, `count` of them."""

    def action() -> None:
        vkbloom.Renderer("software", validation=validation).close()
        vkbloom.adapters()

    return growth(action, count)


def measure(count: int, names: list[str]) -> dict[str, dict[str, float]]:
    """Return the growth for one of each, `count` renderers and a number of frames to suit."""
    scene = vkbloom.Scene.ufo()

    def frame() -> None:
        with vkbloom.Renderer("software") as renderer:
            renderer.render(scene, size=(32, 32))

    measured = {
        "renderer": lambda: renderer_growth(count),
        "validated": lambda: renderer_growth(max(count // 5, 100), validation=True),
        "frame": lambda: growth(frame, max(count // 4, 50)),
        "open": lambda: frame_growth(scene, 2 * count),
    }
    return {name: measured[name]() for name in names or measured}


def main() -> None:
    """Print the growths as JSON."""
    if any(os.environ.get(name) != value for name, value in ENVIRONMENT.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ENVIRONMENT})
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print(json.dumps(measure(count, sys.argv[2:]), indent=1))


if __name__ == "__main__":
    main()
