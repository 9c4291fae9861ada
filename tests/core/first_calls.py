"""First calls of a process from many threads at once: ``python -m tests.core.first_calls NAME``."""

from __future__ import annotations

import os
import random
import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any, Final

import numpy as np

import vkbloom

#: Under sanitizers 32 would wait for the interpreter's lock for fifteen processor seconds.
THREADS: Final = 8 if "VKBLOOM_SANITIZED" in os.environ else 32
METHOD: Final = """\
//!PARAM gain
//!TYPE float
//!MINIMUM 0
//!MAXIMUM 4
2
//!HOOK MAIN
//!BIND GLOW
//!SAVE BLOOM
vec4 hook() { return gain * GLOW_tex(GLOW_pos); }
"""


def apply(index: int) -> Any:
    """Add a preset's bloom by the default renderer."""
    image = np.full((8, 8, 3), 0.25, np.float32)
    return vkbloom.apply(image, "photo", threshold=0.1)["final"].tobytes()


def render(index: int) -> Any:
    """Render a scene with a glare by its name."""
    scene = vkbloom.Scene.ufo()
    frames = vkbloom.render(
        scene, "unity_urp", (16, 16), glare="anamorphic", framebuffers=["final"]
    )
    return frames["final"].tobytes()


def presets(index: int) -> Any:
    """Look up names of presets, in another order in each thread."""
    names = list(vkbloom.presets)
    return {name: vkbloom.presets[name] for name in shuffle(names, index)} | {"": sorted(names)}


def glares(index: int) -> Any:
    """Look up names of glares, in another order in each thread."""
    names = list(vkbloom.glares)
    return {name: vkbloom.glares[name] for name in shuffle(names, index)} | {"": sorted(names)}


def load_method(index: int) -> Any:
    """Load one method everywhere, and one more with a name of the thread's own; both are used."""
    custom = vkbloom.load_method(METHOD, name=f"of_{index}")
    assert vkbloom.Settings.from_dict(custom().to_dict()) == custom()
    kind = vkbloom.load_method(METHOD, name="gained")
    made: Any = kind
    return kind, made(gain=3), vkbloom.Settings.from_dict({"method": "gained", "gain": 3})


def to_xarray(index: int) -> Any:
    """Give a result to a package that vkbloom imports when it is needed."""
    return vkbloom.apply(np.zeros((8, 8, 3), np.float32)).to_xarray()["final"].shape


def names(index: int) -> Any:
    """Look up all public names, in another order in each thread."""
    modules = (vkbloom, vkbloom.psf, vkbloom.reference, vkbloom.testing)
    every = [f"{module.__name__} {name}" for module in modules for name in module.__all__]
    return {
        name: id(getattr(sys.modules[name.split()[0]], name.split()[1]))
        for name in shuffle(every, index)
    }


def shuffle(names: list[str], seed: int) -> list[str]:
    """Return the names in a random order."""
    return random.Random(seed).sample(names, len(names))


CALLS: Final[dict[str, Callable[[int], Any]]] = {
    call.__name__: call for call in (apply, render, presets, glares, load_method, to_xarray, names)
}


def run(name: str) -> int:
    """Make the call in all threads; print what fails, and what differs from the first result."""
    sys.setswitchinterval(1e-6)  # where there is a GIL
    start = threading.Barrier(THREADS)
    results: dict[int, Any] = {}
    failures: list[str] = []

    def call(index: int) -> None:
        start.wait()
        try:
            results[index] = CALLS[name](index)
        except BaseException:
            failures.append(traceback.format_exc())

    threads = [threading.Thread(target=call, args=(index,)) for index in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    different = [index for index in results if results[index] != next(iter(results.values()))]
    for text in dict.fromkeys(failures):
        print(f"{failures.count(text)} of {THREADS} calls of {name}:\n{text}")
    if different:
        print(f"{len(different)} of {THREADS} calls of {name} return something else")
    return 1 if failures or different else 0


if __name__ == "__main__":
    sys.exit(max(map(run, sys.argv[1:])))
