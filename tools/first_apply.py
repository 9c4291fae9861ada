"""Print the table of docs/warm_starts.md: processor seconds of a fresh process' first ``apply``.

``python tools/first_apply.py`` measures each preset in processes of its own: once with empty
caches, three times with the caches that the first one filled, of which it prints the least.
Python's cache of compiled modules is filled from the start, as it is where a package is installed.
VK_DRIVER_FILES chooses the driver; arguments are the presets to measure.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

import vkbloom

FIRST = """
import sys, time
import numpy as np
import vkbloom
image = np.random.default_rng(1).random((180, 320, 3), np.float32) * 2
with vkbloom.Renderer("software") as renderer:
    start = time.process_time()
    renderer.apply(image, vkbloom.presets[sys.argv[1]])
    print(time.process_time() - start)
"""


def seconds(preset: str, caches: str, modules: str) -> float:
    """Return the processor seconds of one process."""
    places = {"VKBLOOM_CACHE_DIR": caches, "MESA_SHADER_CACHE_DIR": caches}
    command = [sys.executable, "-c", FIRST, preset]
    environment = {**os.environ, **places, "OPENBLAS_NUM_THREADS": "1"}
    environment |= {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": modules}
    return float(subprocess.run(command, env=environment, capture_output=True, check=True).stdout)


def main() -> None:
    """Print a row for each preset."""
    chosen = sys.argv[1:] or [*vkbloom.presets]
    with tempfile.TemporaryDirectory() as modules:
        with tempfile.TemporaryDirectory() as caches:
            seconds(chosen[0], caches, modules)
        for preset in chosen:
            with tempfile.TemporaryDirectory() as caches:
                empty = seconds(preset, caches, modules)
                filled = min(seconds(preset, caches, modules) for _ in range(3))
            print(f"| `{preset}` | {empty:.2f} | {filled:.2f} |", flush=True)


if __name__ == "__main__":
    main()
