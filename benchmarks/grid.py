"""Benchmarks of grids: shared passes, stores and workers.

Each part prints its figures. With names of parts as arguments, only these parts run.

    python benchmarks/grid.py [points|workers] ...
"""

from __future__ import annotations

import itertools
import os
import random
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import psutil

import vkbloom

ADAPTER = os.environ.get("VKBLOOM_ADAPTER", "software")
SIDE = int(os.environ.get("GRID_SIDE", "256"))
SETTINGS = vkbloom.Separable()
#: blur_scale x blur_strength x intensity
COUNTS = tuple(int(n) for n in os.environ.get("GRID_COUNTS", "20,20,25").split(","))
SINGLES = int(os.environ.get("GRID_SINGLES", "500"))


def picture(side: int = SIDE) -> np.ndarray[Any, Any]:
    """Return noise with a few lights, as 8-bit values."""
    generator = np.random.default_rng(0)
    image = generator.integers(0, 60, (side, side, 3), dtype=np.uint8)
    for y, x in generator.integers(0, side, (side // 16 + 1, 2)):
        image[y : y + 3, x : x + 3] = 255
    return image


def axes() -> dict[str, Any]:
    """Return three axes. The one that affects only the last pass is in the middle."""
    scale, strength, intensity = COUNTS
    return {
        "blur_scale": np.linspace(0.1, 4, scale),
        "intensity": np.linspace(0, 2, intensity),
        "blur_strength": np.linspace(0.5, 2, strength),
    }


@contextmanager
def folder() -> Iterator[Path]:
    """Create a temporary folder and remove it afterwards."""
    path = Path(tempfile.mkdtemp(prefix="vkbloom-grid-"))
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


@contextmanager
def memory() -> Iterator[list[float]]:
    """Collect the resident memory of this process, in MiB, five times a second."""
    samples: list[float] = []
    watched = psutil.Process()
    end = threading.Event()

    def watch() -> None:
        while not end.wait(0.2):
            samples.append(watched.memory_info().rss / 2**20)

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield samples
    finally:
        end.set()
        thread.join()


def spread(samples: list[float]) -> str:
    """Return the memory at 10, 50 and 100 % of the time, and the maximum."""
    if not samples:
        return "not measured"
    at = [samples[int(share * (len(samples) - 1))] for share in (0.1, 0.5, 1.0)]
    return f"{at[0]:.0f}, {at[1]:.0f}, {at[2]:.0f} MiB at 10, 50, 100 %; at most {max(samples):.0f}"


def points() -> None:
    """10,000 points of 256 x 256 against single calls, with spot checks."""
    image, values = picture(), axes()
    total = int(np.prod([len(value) for value in values.values()]))
    with folder() as path, memory() as samples:
        start = time.perf_counter()
        made = vkbloom.grid(image, SETTINGS, values, store=path / "a.zarr", adapter=ADAPTER)
        seconds = time.perf_counter() - start
        size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
        print(f"{total} points of {SIDE} x {SIDE} into Zarr: {seconds:.1f} s, "
              f"{total / seconds:.0f} points/s, {size / 2**20:.0f} MiB")  # fmt: skip
        print(f"  memory: {spread(samples)}")
        with vkbloom.Renderer(ADAPTER) as renderer:
            every = list(np.ndindex(*made["done"].shape))
            spots = random.Random(1).sample(every, min(50, len(every)))
            for spot in spots:
                chosen: dict[str, Any] = {
                    n: float(v[i]) for (n, v), i in zip(values.items(), spot, strict=True)
                }
                alone = renderer.apply(image, vkbloom.Separable(**chosen), framebuffers="final")
                assert np.array_equal(made["final"][spot].values, alone["final"]), spot
            print(f"  {len(spots)} points equal to single renders")
            start = time.perf_counter()
            dataset = vkbloom.grid(
                image,
                SETTINGS,
                values,
                framebuffers=(),
                reduce={"mean": lambda frames: frames["final"].mean()},
                renderer=renderer,
            )
            seconds_reduced = time.perf_counter() - start
            del dataset
            print(f"  only the means, in memory: {total / seconds_reduced:.0f} points/s")
    singles(image, values, total / seconds)


def singles(image: np.ndarray[Any, Any], values: dict[str, Any], rate: float) -> None:
    """Single calls: nested loops in the order of the axes, and calls that run every pass."""
    names = list(values)
    every: list[dict[str, Any]] = [dict(zip(names, map(float, point), strict=True))
             for point in itertools.product(*values.values())]  # fmt: skip
    with vkbloom.Renderer(ADAPTER) as renderer:
        start = time.perf_counter()
        for changes in every:
            renderer.apply(image, vkbloom.Separable(**changes), framebuffers="final")
        kept = len(every) / (time.perf_counter() - start)
        other = image[::-1].copy()
        chosen = random.Random(2).sample(every, min(SINGLES, len(every)))
        start = time.perf_counter()
        for changes in chosen:
            # Another image in between makes every pass of every point run.
            renderer.apply(image, vkbloom.Separable(**changes), framebuffers="final")
            renderer.apply(other, vkbloom.Separable(**changes), framebuffers="final")
        alone = 2 * len(chosen) / (time.perf_counter() - start)
    print(f"  {len(every)} single calls in nested loops: {kept:.0f} points/s, grid is "
          f"{rate / kept:.2f} times that")  # fmt: skip
    print(f"  {2 * len(chosen)} single calls that run every pass: {alone:.0f} points/s, grid is "
          f"{rate / alone:.2f} times that")  # fmt: skip


def workers() -> None:
    """Two workers against one, and against this process."""
    image, values = picture(), axes()
    values = {name: value[:: max(1, len(value) // 8)] for name, value in values.items()}
    total = int(np.prod([len(value) for value in values.values()]))
    rates = {}
    for threads in ("all", "1"):
        environment = {} if threads == "all" else {"LP_NUM_THREADS": threads}
        os.environ.update(environment)
        for count in (1, 2):
            with (
                folder() as path,
                distributed.LocalCluster(  # type: ignore[no-untyped-call]
                    n_workers=count, threads_per_worker=1, dashboard_address="127.0.0.1:0"
                ) as cluster,
                distributed.Client(cluster) as client,  # type: ignore[no-untyped-call]
            ):
                warm = {name: value[:2] for name, value in values.items()}
                vkbloom.grid(image, SETTINGS, warm, store=path / "w.zarr", client=client,
                                     adapter=ADAPTER)  # fmt: skip
                start = time.perf_counter()
                vkbloom.grid(image, SETTINGS, values, store=path / "a.zarr", client=client,
                                            adapter=ADAPTER)  # fmt: skip
                rates[count] = total / (time.perf_counter() - start)
                print(f"{count} workers, lavapipe threads for each worker: {threads}: "
                      f"{rates[count]:.0f} points/s of {total}")  # fmt: skip
        print(f"  two against one: {rates[2] / rates[1]:.2f}")
    os.environ.pop("LP_NUM_THREADS", None)


PARTS: dict[str, Callable[[], None]] = {"points": points, "workers": workers}

if __name__ == "__main__":
    for part in sys.argv[1:] or PARTS:
        print(f"== {part}: {PARTS[part].__doc__}")
        PARTS[part]()
