"""The grid that the scripts of this folder render: replace it by your own."""

from __future__ import annotations

from typing import Any

import numpy as np

import vkbloom


def render(client: Any, store: str, part: tuple[int, int] | None = None) -> None:
    """Render a grid into a store that all workers can write to, and print its mean brightness.

    The same call continues a grid that was interrupted. Only the part (i, n) if one is given.
    """
    image = np.zeros((90, 160, 3), np.float32)
    image[40:44, 60:100] = (20, 12, 4)
    axes = {"radius": np.linspace(0.5, 4, 8), "intensity": [0.1, 0.25, 0.5, 1.0]}
    dataset = vkbloom.grid(
        image, vkbloom.Pyramid(threshold=1), axes, store=store, client=client, part=part
    )
    if part is None:
        print(dataset["final"].mean(["y", "x", "channel"]).round(4).values)
