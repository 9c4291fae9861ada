"""Import, renderer and first frame, in fresh processes.

Forward frame of the built-in scene, all defaults, `final` read back. Without caches, the folder of
vkbloom's pipeline cache is empty, and the driver's own shader cache is off. All files are in the
system's page cache, so that the disk is not measured.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Final

from benchmarks.ours import prepare_child
from benchmarks.plan import Plan
from benchmarks.results import Section, Table
from benchmarks.timing import Contender, Rounds, Times, alternate

__all__ = ["run"]

ROUNDS: Final = 9
SIZE: Final = (1280, 720)

_FIRST_FRAMES: Final = """
import json, sys, time
start = time.perf_counter()
import vkbloom
steps = {"import vkbloom": time.perf_counter() - start}

def step(name, work):
    start = time.perf_counter()
    result = work()
    steps[name] = time.perf_counter() - start
    return result

renderer = step("Renderer()", lambda: vkbloom.Renderer(sys.argv[1]))
scene = step("Scene.ufo()", vkbloom.Scene.ufo)
size = json.loads(sys.argv[2])
for turn, name in enumerate(("first frame", "second frame")):
    step(name, lambda: renderer.render(scene, size=size, time=0.1 * turn, framebuffers=("final",)))
print(json.dumps(steps))
"""

#: The pipeline caches that are filled before a process starts.
_CACHES: Final = (
    "no caches",
    "vkbloom's pipeline cache",
    "vkbloom's and the driver's caches",
)


def run(plan: Plan, section: Section) -> None:
    """Time the imports and the first frame of fresh processes."""
    size = plan.size(*SIZE)
    section.title = f"Start-up, in fresh processes; frames of {size[0]} x {size[1]}"
    rounds = Rounds(1, 1, 0.0) if plan.quick else plan.times(ROUNDS)
    _imports(plan, section, rounds)
    _frames(plan, section, rounds, size)


def _imports(plan: Plan, section: Section, rounds: Rounds) -> None:
    """Add the times of imports as complete processes."""
    plan.tell("startup: imports")
    statements = {
        "Python alone": "pass",
        "import numpy": "import numpy",
        "import vkbloom": "import vkbloom",
    }
    calls = {name: prepare_child(statement, ()) for name, statement in statements.items()}
    times = alternate(
        [
            Contender(name, lambda _, call=call: call())  # type: ignore[misc]
            for name, call in calls.items()
        ],
        rounds,
        warm_up=0 if plan.quick else 1,
    )
    section.add_times("processes", times)
    bare = times["Python alone"]
    rows = tuple(
        (
            name,
            f"{1e3 * measured.median:.1f}",
            f"{1e3 * measured.least:.1f}",
            f"{1e3 * (measured.median - bare.median):.1f}",
        )
        for name, measured in times.items()
    )
    header = ("process", "median, ms", "least, ms", "minus Python alone, ms")
    section.tables.append(Table("Imports, from start to exit of a process", header, rows))


def _frames(plan: Plan, section: Section, rounds: Rounds, size: tuple[int, int]) -> None:
    """Add the times of the renderer and the first frames, by the state of the caches."""
    plan.tell("startup: first frames")
    steps: dict[str, dict[str, list[float]]] = {name: {} for name in _CACHES}
    with tempfile.TemporaryDirectory() as folder:
        for name in _CACHES[1:]:
            # Fill the caches.
            _first_frames(plan, name, Path(folder), size)
        for turn in range(rounds.least):
            for name in _CACHES:
                place = Path(folder)
                if name == _CACHES[0]:
                    place = place / f"round{turn}"
                for step, seconds in _first_frames(plan, name, place, size).items():
                    steps[name].setdefault(step, []).append(seconds)
    columns: dict[str, dict[str, Times]] = {}
    for name, found in steps.items():
        measured = {step: Times(tuple(seconds)) for step, seconds in found.items()}
        until = zip(*(found[step] for step in list(found)[:-1]), strict=True)
        measured["total to the first frame"] = Times(tuple(sum(parts) for parts in until))
        columns[name] = measured
        section.add_times(f"first frames, {name}", measured)
    rows = tuple(
        (step, *(f"{1e3 * columns[name][step].median:.1f}" for name in _CACHES))
        for step in columns[_CACHES[0]]
    )
    header = ("median, ms", *_CACHES)
    section.tables.append(Table("From import to frame", header, rows))


def _first_frames(plan: Plan, caches: str, folder: Path, size: tuple[int, int]) -> dict[str, float]:
    arguments = plan.adapter, json.dumps(size)
    call = prepare_child(_FIRST_FRAMES, arguments, folder, of_driver=caches == _CACHES[2])
    steps: dict[str, float] = json.loads(call())
    return steps
