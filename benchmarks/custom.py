"""A custom method beside the same rows built in, and the time that loading takes.

The custom method is the example in forty lines: a copy of what glows at half the size, and two
blurs of 25 taps. The built-in method is `Separable` on bloom buffers of half the size, with equal
weights. Both run as fragment passes on images of float16 RGBA, another one in each round. The time
is that of the three passes on the device.

Loading: a process that has loaded another file before loads the example, with an empty cache and
again with the cache filled. The compiler of the first load, glslang, is a process for each pass.
"""

from __future__ import annotations

import itertools
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Final

import numpy as np

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import contender, contest, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section, Table
from benchmarks.timing import Contender, alternate
from vkbloom._custom.compiler import find_compiler
from vkbloom._settings.registry import METHODS

__all__ = ["run"]

FILE: Final = Path(__file__).parents[1] / "examples" / "custom_methods" / "forty_lines.hook"
SIZE: Final = (1920, 1080)
ROUNDS: Final = 25
LOADS: Final = 15
#: The passes of both that do the same work.
OWN_PASSES: Final = ("half", "rows", "bloom_own")
BUILT_IN_PASSES: Final = ("glow", "blur_vertical", "bloom")
OWN: Final = "custom method"
BUILT_IN: Final = "built in"
PASSES: Final = 3


def run(plan: Plan, section: Section) -> None:
    """Time the passes of both, and loading."""
    section.title = "A custom method beside the same rows built in"
    kind: type[vkbloom.Settings] = vkbloom.load_method(FILE)
    _passes(plan, section, kind)
    _loading(plan, section)


def _passes(plan: Plan, section: Section, kind: type[vkbloom.Settings]) -> None:
    size = plan.size(*SIZE)
    # All calls of the renderer share them, so that each has another image than the one before.
    images = itertools.cycle(pictures(size, np.float16))
    weights = vkbloom.gaussian_weights(2.5, 12)
    both = {
        OWN: (kind(), OWN_PASSES),
        BUILT_IN: (
            vkbloom.Separable(weights=weights, blur_strength=1.0, bloom_scale=0.5),
            BUILT_IN_PASSES,
        ),
    }
    with plan.renderer("fragment") as renderer:
        contenders = [
            Contender(
                name,
                contender(name, renderer, images, settings).call,
                lambda frames, passes=passes: sum(frames.timings[one] for one in passes),  # type: ignore[misc]
            )
            for name, (settings, passes) in both.items()
        ]
        caption = f"Three passes, {size[0]} x {size[1]}"
        times = contest(plan, section, "passes", contenders, ROUNDS, caption=caption, ours=BUILT_IN)
    ratios(section, "three passes", times, (OWN, BUILT_IN, 1.1, True))


def _loading(plan: Plan, section: Section) -> None:
    kept = os.environ.get("VKBLOOM_CACHE_DIR")
    with tempfile.TemporaryDirectory() as folder:

        def loaded(cache: str) -> None:
            os.environ["VKBLOOM_CACHE_DIR"] = f"{folder}/{cache}"
            METHODS.unregister(FILE.stem)
            vkbloom.load_method(FILE)

        def started(_: int) -> None:
            command = [find_compiler(), "--stdin", "-S", "frag"]
            shader = b"#version 450\nvoid main() {}\n"
            subprocess.run(command, input=shader, stdout=subprocess.DEVNULL, check=True)

        try:
            times = alternate(
                [
                    Contender("first load", lambda turn: loaded(f"round{turn}")),
                    Contender("load from the cache", lambda _: loaded("round0")),
                    Contender("glslang, an empty shader", started),
                ],
                plan.times(LOADS),
                warm_up=1,
            )
        finally:
            del os.environ["VKBLOOM_CACHE_DIR"]
            if kept is not None:
                os.environ["VKBLOOM_CACHE_DIR"] = kept
    section.times["loading"] = times
    rows = tuple(
        (
            name,
            f"{1e3 * measured.median:.2f}",
            f"{1e3 * measured.least:.2f}",
            f"{1e3 * measured.median / PASSES:.2f}" if "load" in name else "",
        )
        for name, measured in times.items()
    )
    header = ("", "median, ms", "least, ms", "a pass, ms")
    section.tables.append(Table(f"Loading {FILE.name}, {PASSES} passes", header, rows))
