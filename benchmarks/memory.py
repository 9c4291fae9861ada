"""Memory of a process and of its renderers.

A fresh process opens a renderer, applies all presets to uint8, float16 and float32 images of
128 x 72, and closes it. After each step stands the resident memory of the process, which includes
the images of a CPU adapter. The images that a renderer keeps after one call are of 1920 x 1080,
half-float RGBA, with all that the preset makes.
"""

from __future__ import annotations

import json
import sys
from typing import Final

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import prepare_child
from benchmarks.plan import Plan
from benchmarks.results import Section, Table

__all__ = ["run"]

SIZE: Final = (1920, 1080)
ROUNDS: Final = 3
PROCESS: Final = "resident memory of the process"
IMAGES: Final = "images of the renderer"

_STEPS: Final = """
import gc, json, os, sys
import numpy as np
steps = {}

def note(step):
    gc.collect()
    with open("/proc/self/statm") as file:
        steps[step] = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

note("NumPy")
import vkbloom
note("vkbloom")
renderer = vkbloom.Renderer(sys.argv[1])
note("a renderer")
names = list(vkbloom.presets)[: int(sys.argv[2])]
for dtype in (np.uint8, np.float16, np.float32):
    image = np.ones((72, 128, 4), dtype)
    for name in names:
        renderer.apply(image, vkbloom.presets[name])
    note(f"all presets, {np.dtype(dtype).name} too")
renderer.close()
del renderer
note("the renderer is closed")
print(json.dumps(steps))
"""


def run(plan: Plan, section: Section) -> None:
    """Measure a process in steps, and the images of each preset."""
    section.title = "Memory"
    count = 2 if plan.quick else len(vkbloom.presets)
    if sys.platform == "linux":
        call = prepare_child(_STEPS, (plan.adapter, str(count)))
        found = [json.loads(call()) for _ in range(1 if plan.quick else ROUNDS)]
        for step in found[0]:
            section.add_memory(step, PROCESS, [steps[step] for steps in found])
    else:
        section.missing.append(f"{PROCESS}: {sys.platform} has no /proc/self/statm")
    size = plan.size(*SIZE)
    image = pictures(size, "float16")[0]
    for name in list(vkbloom.presets)[:count]:
        plan.tell(f"memory: {name}")
        with plan.renderer() as renderer:
            renderer.apply(image, vkbloom.presets[name], framebuffers=("final",))
            section.add_memory(name, IMAGES, [renderer._core.cached[1] / 2**20])
    rows = tuple((one.group, one.name, f"{one.value} {one.unit}") for one in section.records)
    header = ("after or of", "what", "median (interval)")
    section.tables.append(Table("", header, rows))
