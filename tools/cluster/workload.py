"""The grid of 2,000 points that stands in for examples/cluster/workload.py."""

from __future__ import annotations

from typing import Any

import numpy as np

import vkbloom

IMAGE = np.zeros((96, 128, 3), np.float32)
IMAGE[40:44, 60:100] = (20, 12, 4)
AXES: dict[str, Any] = {"radius": np.linspace(0.5, 4, 40), "intensity": np.linspace(0.02, 1, 50)}
CHUNKS = {"intensity": 10}


def render(client: Any, store: str, part: tuple[int, int] | None = None) -> None:
    """Render the grid, or a part of it."""
    settings = vkbloom.Pyramid(threshold=1)
    vkbloom.grid(
        IMAGE, settings, AXES, store=store, client=client, part=part, chunks=CHUNKS, progress=False
    )
