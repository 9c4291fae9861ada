"""Try images_on_ray.py beside `map`, on images in the current folder."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import images_on_ray
import numpy as np

import vkbloom

COUNT = 64
WIDTH, HEIGHT = 640, 360
PICTURE_BYTES = HEIGHT * WIDTH * 3 * 4
# As many pictures may wait; as many more are in the actors, and with the reader.
WAITING = 12


class Timed(images_on_ray.Bloom):
    """Notes when each batch was rendered."""

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        """Add the time."""
        made = super().__call__(batch)
        return {**made, "time": [time.time()] * len(batch["path"])}


def main() -> None:
    """Make images, and compare order, bytes, times and what waits for a slow reader."""
    folder = Path("images").resolve()
    folder.mkdir()
    noise = np.random.default_rng(0)
    paths = [folder / f"{number:03}.exr" for number in range(COUNT)]
    for path in paths:
        vkbloom.write(path, noise.random((HEIGHT, WIDTH, 3), np.float32) * 2)

    with vkbloom.Renderer() as renderer:
        images = map(vkbloom.read, paths)
        begun = time.perf_counter()
        local = [f["final"] for f in renderer.map(images, framebuffers="final")]
        seconds = time.perf_counter() - begun
        print(f"images: map, {COUNT} of {WIDTH} x {HEIGHT}: {seconds:.2f} s")

    for actors in (1, 2):
        begun = time.perf_counter()
        rows = iter(images_on_ray.dataset(paths, actors=actors).iter_rows())
        first = next(rows)
        started = time.perf_counter()
        found = [first, *rows]
        ended = time.perf_counter()
        assert [row["path"] for row in found] == [str(path) for path in paths]
        assert all(np.array_equal(row["final"], one) for row, one in zip(found, local, strict=True))
        print(
            f"images: Ray Data, {actors} actors: {ended - begun:.2f} s, of which "
            f"{started - begun:.2f} s until the first picture; in order, the same bytes"
        )

    slow = images_on_ray.dataset(paths, actors=2, limit=WAITING * PICTURE_BYTES, actor=Timed)
    taken, made = [], []
    for row in slow.iter_rows():
        taken.append(time.time())
        made.append(row["time"])
        time.sleep(0.1)
    waiting = [
        sum(one <= now for one in made) - number for number, now in enumerate(taken, start=1)
    ]
    print(f"images: slow reader: at most {max(waiting)} of {COUNT} pictures waited")
    assert max(waiting) < COUNT // 2, waiting


if __name__ == "__main__":
    main()
