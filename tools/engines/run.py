"""Run an engine, in its own environment: python run.py ENGINE CASES OUT.

CASES is a JSON file with a list of names of images and parameters. OUT gets the engine's versions,
and each case's arrays under the case's number and their name.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from pathlib import Path

import numpy as np
from cases import image, kernel

ENGINES = {
    "blender": ("blender", "Blender"),
    "blender-5.2": ("blender", "Blender"),
    "pygfx": ("pygfx_bloom", "Pygfx"),
}


def main() -> None:
    """Render all cases."""
    name, cases, out = sys.argv[1:]
    module, kind = ENGINES[name]
    engine = getattr(importlib.import_module(module), kind)()
    arrays = {}
    start = time.perf_counter()
    for number, (picture, fields) in enumerate(json.loads(Path(cases).read_text())):
        if "kernel" in fields:
            fields["kernel"] = kernel(*fields["kernel"])
        for key, array in engine.render(image(picture), fields).items():
            arrays[f"{number}/{key}"] = array[..., :3]
    seconds = np.float64(time.perf_counter() - start)
    versions = np.array(json.dumps(engine.versions()))
    np.savez(out, versions=versions, seconds=seconds, **arrays)


if __name__ == "__main__":
    main()
