"""Prepare a store while other processes do the same."""

from __future__ import annotations

from pathlib import Path
from queue import Queue
from threading import Barrier

import numpy as np

from vkbloom import Separable
from vkbloom._grid.layout import Grid, Layout, Variable, ask
from vkbloom._grid.store import prepare as prepare_store


def laid_out(intensity: float) -> tuple[Grid, Layout]:
    """Return a grid and its variables, without a device."""
    image = np.zeros((4, 4, 3), np.uint8)
    axes = {"exposure": np.linspace(0, 1, 8)}
    grid = ask(
        image,
        Separable(intensity=intensity),
        axes,
        size=None,
        shading="forward",
        time=0,
        framebuffers="final",
        reduce=None,
    )
    final = Variable(("y", "x", "channel"), (4, 4, 3), np.dtype(np.uint8), {})
    return grid, Layout((0,), {"final": final}, {}, "adapter", "driver", "1.0")


def prepare(store: Path, part: tuple[int, int], intensity: float, start: Barrier) -> str:
    """Return what is said of the store when all processes have come here."""
    grid, layout = laid_out(intensity)
    start.wait(60)
    try:
        prepare_store(store, grid, layout, (1,), part, resume=True)
    except ValueError as error:
        return str(error)
    return ""


def prepare_all(
    stores: list[Path], part: tuple[int, int], intensity: float, start: Barrier, said: Queue[str]
) -> None:
    """Prepare one store after the other, and put what is said of each into the queue."""
    for store in stores:
        said.put(f"{store.name} {intensity}: {prepare(store, part, intensity, start)}")
