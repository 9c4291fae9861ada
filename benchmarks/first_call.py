"""The first call of each preset, in fresh processes: a 1920 x 1080 float32 RGB image.

The import and the renderer's start are not counted. Each process without caches has new folders for
vkbloom's cache and the driver's; the next process finds what it left there. By the wall clock.
"""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import Final

import vkbloom
from benchmarks.ours import prepare_child
from benchmarks.plan import Plan
from benchmarks.results import Section, side_by_side
from benchmarks.timing import Times

__all__ = ["run"]

SIZE: Final = (1920, 1080)
ROUNDS: Final = 3
EMPTY: Final = "empty caches"
FILLED: Final = "filled caches"

_FIRST_CALL: Final = """
import json, sys, time
import numpy as np
import vkbloom
width, height = json.loads(sys.argv[2])
image = np.random.default_rng(0).random((height, width, 3), np.float32)
settings = vkbloom.presets[sys.argv[3]]
with vkbloom.Renderer(sys.argv[1]) as renderer:
    start = time.perf_counter()
    renderer.apply(image, settings, framebuffers=("final",))
    print(time.perf_counter() - start)
"""


def run(plan: Plan, section: Section) -> None:
    """Time two processes of each preset, in turn."""
    size = plan.size(*SIZE)
    section.title = f"First calls in fresh processes, {size[0]} x {size[1]}, float32 RGB"
    rounds = plan.times(ROUNDS)
    names = list(vkbloom.presets)[:2] if plan.quick else list(vkbloom.presets)
    for name in names:
        plan.tell(f"first-call: {name}")
        seconds: dict[str, list[float]] = {FILLED: [], EMPTY: []}
        start = time.perf_counter()
        for turn in range(1 if plan.quick else rounds.least):
            if turn >= 2 and time.perf_counter() - start > rounds.seconds:
                break
            with tempfile.TemporaryDirectory() as folder:
                arguments = plan.adapter, json.dumps(size), name
                call = prepare_child(_FIRST_CALL, arguments, Path(folder))
                for state in (EMPTY, FILLED):
                    seconds[state].append(float(call()))
        times = {state: Times(tuple(each)) for state, each in seconds.items()}
        section.add_times(name, times)
        section.tables.append(side_by_side(name, times, FILLED))
