"""Render many frames of changing size and settings, and check that the process does not grow.

``python tools/soak.py [FRAMES]`` (20,000) prints memory in bytes, file descriptors and threads of
the process after every tenth of the frames. It returns 1 if memory grows in the second half by
more than a page for a hundred frames, or if the descriptors or threads change; of less than 1,000
frames it judges nothing. Linux with glibc 2.33 or newer.
"""

from __future__ import annotations

import random
import sys
import time

import numpy as np
from renderer_memory import SIZES, sizes

import vkbloom
from vkbloom._renderer.surface import Surface

STEPS = 10


def frame(
    renderer: vkbloom.Renderer,
    surface: Surface | None,
    scene: vkbloom.Scene,
    dice: random.Random,
) -> None:
    """Render one frame with random size, source and settings."""
    # Some presets have levels of a fixed height; their width depends on the frame's aspect.
    size = (dice.randrange(4, 65), dice.randrange(4, 65))
    if dice.random() < 0.01:
        # Large arrays use recycled pages of the renderer.
        size = (dice.randrange(256, 400), dice.randrange(256, 400))
    settings = dice.choice(
        [
            vkbloom.Separable(blur_strength=dice.random(), loops=dice.randrange(1, 4)),
            vkbloom.Separable(bloom_size=(dice.randrange(1, 40), dice.randrange(1, 40))),
            vkbloom.Pyramid(levels=dice.randrange(1, 7), exposure=dice.random()),
            vkbloom.DualKawase(levels=dice.randrange(1, 5)),
            *vkbloom.presets.values(),
        ]
    )
    if surface and dice.random() < 0.2:
        surface.present(scene, settings, time=dice.random())
        if dice.random() < 0.05:
            with Surface(renderer, size=size) as other:
                other.present(scene, settings, time=dice.random())
        return
    if dice.random() < 0.3:
        shading = dice.choice(("forward", "deferred"))
        renderer.render(scene, settings, size, shading=shading, time=dice.random())
        return
    dtype = dice.choice((np.uint8, np.float16, np.float32))
    pixels = np.full((size[1], size[0], dice.choice((3, 4))), dice.randrange(1, 200), dtype)
    if dice.random() < 0.1:
        # Abandon the sequence half way.
        next(iter(renderer.sweep(pixels, [settings] * 4)))
    else:
        renderer.apply(pixels, settings, framebuffers=dice.choice(("all", "final")))


def main(total: int) -> int:
    """Print a row for each tenth; return 1 if something grows."""
    dice = random.Random(9)
    scene = vkbloom.Scene.ufo()
    rows: list[dict[str, int]] = []
    begin = time.perf_counter()
    with vkbloom.Renderer("software") as renderer:
        try:
            surface = Surface(renderer, size=(40, 30))
        except vkbloom.Error as error:
            print(f"Nothing is presented: {error}")
            surface = None
        for step in range(STEPS):
            for _ in range(total // STEPS):
                frame(renderer, surface, scene, dice)
            # The same last frames, so that each count sees the same cached objects.
            for _ in range(4):
                renderer.render(scene, None, (16, 16))
            renderer.apply(np.zeros((8, 8, 3), np.float32))
            # One array replaces all idle pages, so that each count sees the same number of them.
            renderer._core.pages(256 << 20)
            rows.append(dict(zip(SIZES, sizes(), strict=True)))
            shown = ", ".join(f"{name} {value}" for name, value in rows[-1].items())
            print(f"{(step + 1) * (total // STEPS):>8} frames: {shown}", flush=True)
    print(f"{time.perf_counter() - begin:.0f} s")
    middle, last = rows[STEPS // 2 - 1], rows[-1]
    grown = (last["heap"] - middle["heap"]) / (total / 2)
    print(f"{grown:.1f} bytes of heap a frame in the second half")
    same = all(last[name] == middle[name] for name in ("descriptors", "threads"))
    # Fewer frames are still filling caches.
    return int(total >= 1000 and (grown > 41 or not same))


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 20_000))
