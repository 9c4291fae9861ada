"""Draw the pictures of docs/selective.md.

python tools/selective_pictures.py docs/pictures

- selective.jpg: the saucer without bloom, with all of its bloom, with a mask, with an emission
- transparent.jpg: a bloom on transparent ground, laid over squares, with each value of `alpha`
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom

SIZE = (480, 270)
Image = NDArray[Any]


def scene_frames(renderer: vkbloom.Renderer) -> vkbloom.Frames:
    """Return the framebuffers of the saucer in deferred shading, its lamps brighter than white."""
    scene = dataclasses.replace(vkbloom.Scene.ufo(), glow_intensity=3.0)
    return renderer.render(scene, vkbloom.Separable(), SIZE, shading="deferred")


def selective(renderer: vkbloom.Renderer) -> Image:
    """Return four pictures beside each other: what glows of one picture."""
    frames = scene_frames(renderer)
    picture = frames["scene"][..., :3]
    settings = vkbloom.Pyramid(threshold=0.1, knee=0.5, intensity=1.5, tonemap="aces")
    right = np.zeros(picture.shape[:2], np.float32)
    right[:, SIZE[0] // 2 :] = 1
    shown = [
        renderer.apply(picture, settings.replace(bloom=False)),
        renderer.apply(picture, settings),
        renderer.apply(picture, settings, mask=right),
        renderer.apply(picture, settings, emission=frames["brightness"][..., :3]),
    ]
    rows = np.array([frames["final"] for frames in shown], np.float32)
    return np.vstack([np.hstack(rows[:2]), np.hstack(rows[2:])])


def transparent(renderer: vkbloom.Renderer) -> Image:
    """Return a lamp on transparent ground over squares, for "keep", "max" and "blur"."""
    height, width = 180, 240
    y, x = np.mgrid[:height, :width]
    inside = np.clip(40.5 - np.hypot(x - width / 2, y - height / 2), 0, 1).astype(np.float32)
    lamp = inside[..., None] * np.array([0.6, 0.25, 0.05, 1.0], np.float32)
    light = ((x // 12 + y // 12) % 2 * 0.15 + 0.25).astype(np.float32)[..., None]
    shown = []
    for alpha in ("keep", "max", "blur"):
        settings = vkbloom.Pyramid(levels=5, alpha=alpha, intensity=4.0)
        final = renderer.apply(lamp, settings)["final"]
        shown.append(final[..., :3] + (1 - final[..., 3:]) * light)
    return np.hstack(shown)


def main(folder: Path) -> None:
    """Write both pictures."""
    with vkbloom.Renderer() as renderer:
        vkbloom.write(folder / "selective.jpg", selective(renderer), quality=92)
        vkbloom.write(folder / "transparent.jpg", transparent(renderer), quality=92)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
