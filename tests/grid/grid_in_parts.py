"""Render parts of a grid, named by standard input, into the store of the first argument.

After the word "killed" the process kills itself when two chunks are written.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np

import vkbloom
from vkbloom._grid.store import Chunks


def render(store: Path | str, part: str | None) -> None:
    """Render 120 points in 30 chunks."""
    vkbloom.grid(
        np.random.default_rng(3).random((12, 10, 3), dtype=np.float32),
        vkbloom.Separable(threshold=0.2),
        {
            "blur_scale": np.linspace(0.5, 2, 5),
            "exposure": np.linspace(-1, 1, 6),
            "blur_strength": np.linspace(1, 2, 4),
        },
        store=store,
        chunks={"blur_strength": 4},
        reduce={"framebuffers": len},
        part=part,
        progress=False,
    )


def kill_after_two_chunks(store: Path | str) -> None:
    """End this process as by a power failure; a folder has a temporary file then."""
    written: list[Any] = []
    write = Chunks.write

    def writing(self: Chunks, block: Any, arrays: Any) -> None:
        if len(written) == 2:
            if isinstance(store, Path):
                (store / "final" / f"c.{os.getpid()}.partial").write_bytes(b"half of it")
            os.kill(os.getpid(), signal.SIGKILL)
        written.append(block)
        write(self, block, arrays)

    Chunks.write = writing  # type: ignore[method-assign]


if __name__ == "__main__":
    named = sys.argv[1] if "://" in sys.argv[1] else Path(sys.argv[1])
    for word in sys.stdin.read().split():
        if word == "killed":
            kill_after_two_chunks(named)
        else:
            render(named, word)
