"""A grid of small points into the store of the first argument; tests kill it.

The second argument is the number of blocks in units of 10, by default 5: 1000 points.
"""

from __future__ import annotations

import sys

import numpy as np

import vkbloom

if __name__ == "__main__":
    vkbloom.grid_to_zarr(
        np.random.default_rng(3).random((12, 10, 3), dtype=np.float32),
        vkbloom.Separable(threshold=0.2),
        {
            "blur_scale": np.linspace(0.5, 2, int(sys.argv[2]) if len(sys.argv) > 2 else 5),
            "exposure": np.linspace(-1, 1, 20),
            "blur_strength": np.linspace(1, 2, 10),
        },
        sys.argv[1],
        chunks={"exposure": 20, "blur_strength": 1},
        reduce={"mean": vkbloom.reductions.Mean()},
        progress=False,
    )
