"""Run an engine as a program: python apply.py ENGINE OUTPUT PARAMETERS IN.pfm OUT.pfm.

OUTPUT is one of the engine's arrays, such as "glare"; PARAMETERS are JSON. For
``vkbloom check --command``, in the engine's own environment (laws.py).
"""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path

import numpy as np
from run import ENGINES


def read(path: str) -> np.ndarray:
    """Return the image of a PFM file of three channels, top row first."""
    _, size, scale, data = Path(path).read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    order = "<f4" if float(scale) < 0 else ">f4"
    return np.frombuffer(data, order).reshape(height, width, 3)[::-1]


def write(path: str, image: np.ndarray) -> None:
    """Write an RGB image as PFM."""
    height, width, _ = image.shape
    head = f"PF\n{width} {height}\n-1\n".encode()
    Path(path).write_bytes(head + image[::-1].astype("<f4").tobytes())


def main() -> None:
    """Read, render and write."""
    name, output, parameters, source, target = sys.argv[1:]
    module, kind = ENGINES[name]
    engine = getattr(importlib.import_module(module), kind)()
    write(target, engine.render(read(source), json.loads(parameters))[output][..., :3])


if __name__ == "__main__":
    main()
