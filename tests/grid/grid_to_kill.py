"""A grid of 1000 small points into the store of the first argument; a test kills it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import vkbloom


def fill(store: Path | str) -> None:
    """Render what is missing."""
    vkbloom.grid(
        np.random.default_rng(3).random((12, 10, 3), dtype=np.float32),
        vkbloom.Separable(threshold=0.2),
        {
            "blur_scale": np.linspace(0.5, 2, 5),
            "exposure": np.linspace(-1, 1, 20),
            "blur_strength": np.linspace(1, 2, 10),
        },
        store=store,
        chunks={"exposure": 20, "blur_strength": 1},
        reduce={"framebuffers": len},
        progress=False,
    )


if __name__ == "__main__":
    fill(sys.argv[1])
