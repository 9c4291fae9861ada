"""Apply bloom to images with Ray Data: ``python images_on_ray.py FOLDER OUT``.

Each actor has one renderer. Images come back in their order, while others are rendered; a slow
reader of the results stops the actors when LIMIT bytes wait.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import ray
import ray.data

import vkbloom

BATCH = 4
LIMIT = 1 << 30


class Bloom:
    """An actor, which takes batches of paths."""

    def __init__(self) -> None:
        self.renderer = vkbloom.Renderer()

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        """Return the pictures of a batch."""
        images = map(vkbloom.read, batch["path"])
        frames = self.renderer.map(images, framebuffers="final")
        return {"path": batch["path"], "final": [frame["final"] for frame in frames]}


def dataset(paths: Iterable[Path], *, actors: int = 2) -> Any:
    """Return a Ray dataset with the path and the picture of each image."""
    options = ray.data.DataContext.get_current().execution_options
    options.preserve_order = True
    options.resource_limits = options.resource_limits.copy(object_store_memory=LIMIT)
    rows = [{"path": str(path.resolve())} for path in paths]
    blocks = -(-len(rows) // BATCH)
    return ray.data.from_items(rows, override_num_blocks=blocks).map_batches(
        Bloom, batch_size=BATCH, compute=ray.data.ActorPoolStrategy(size=actors)
    )


def main() -> None:
    """Render a folder."""
    folder, out = map(Path, sys.argv[1:])
    out.mkdir(exist_ok=True)
    ray.init()
    for row in dataset(sorted(folder.iterdir())).iter_rows():
        vkbloom.write(out / f"{Path(row['path']).stem}.exr", row["final"])


if __name__ == "__main__":
    main()
