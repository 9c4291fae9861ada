"""Damaged folders of a grid's image files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vkbloom import presets
from vkbloom._cli.grid import prepare
from vkbloom._grid.identity import identity
from vkbloom._grid.layout import Grid, Layout, Variable, ask

SETTINGS = presets["bevy_natural"]
AXES = {"exposure": [0.0, 1.0, 2.0], "threshold": [None, 0.5]}
IMAGE = np.linspace(0, 1, 60, dtype=np.float32).reshape(4, 5, 3)
CHANNELS = np.array(["r", "g", "b", "a"])


def _laid_out(grid: Grid) -> Layout:
    final = Variable(("y", "x", "rgba"), (4, 5, 4), np.dtype(np.float32), {"long_name": "final"})
    mean = Variable((), (), np.dtype(np.float64), {"units": "1"})
    return Layout(
        ranking=(0, 1),
        variables={"final": final, "mean": mean},
        coordinates={"rgba": (CHANNELS, {"long_name": "channel"})},
        ran=0,
        adapter="none",
        driver="none",
        version="0",
    )


def _asked() -> Grid:
    return ask(
        IMAGE,
        SETTINGS,
        AXES,
        size=None,
        shading="forward",
        time=0.0,
        framebuffers="final",
        reduce=None,
    )


class Folders:
    """A grid's folder of image files with another ``grid.json``.

    Parameters
    ----------
    folder : Path
        The parent folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder / "images"
        grid = _asked()
        self._identity = {**identity(grid, _laid_out(grid), ()), "suffix": ".png"}
        prepare(self._folder, self._identity, resume=False)
        self._index = self._folder / "grid.json"

    def seeds(self) -> list[bytes]:
        """Return the content of the file."""
        return [self._index.read_bytes()]

    def run(self, data: bytes) -> None:
        """Continue the folder."""
        self._index.write_bytes(data)
        try:
            prepare(self._folder, self._identity, resume=True)
        finally:
            assert self._index.read_bytes() == data, "what was there was changed"
