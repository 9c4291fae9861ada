"""Remove the glare of a known lens from a picture.

The picture is A x with the linear bloom A. The clean image x minimizes |A x - picture|^2 with
x >= 0, by conjugate gradients that start anew where the set of zero values changes.

python examples/gradients/glare_removal.py glare_removal.png
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom

STEPS = 30
LENS = vkbloom.Pyramid(levels=4, intensity=0.5)


def night(height: int = 72, width: int = 128) -> NDArray[np.float32]:
    """Return a dark scene with lamps and a dim gradient."""
    random = np.random.default_rng(4)
    image = np.full((height, width, 3), 0.02, np.float32)
    image[height // 2 :] += np.linspace(0, 0.15, width, dtype=np.float32)[None, :, None]
    for _ in range(14):
        y, x = random.integers(2, height - 3), random.integers(2, width - 3)
        image[y : y + 2, x : x + 2] = random.uniform(4, 20) * random.uniform(0.4, 1, 3)
    return image


def cleaned(
    renderer: vkbloom.Renderer, picture: NDArray[Any], lens: vkbloom.Settings
) -> NDArray[np.float32]:
    """Return the non-negative image whose bloom is the picture."""
    _, pullback = vkbloom.vjp(picture, lens, renderer=renderer)

    def apply(image: NDArray[Any]) -> NDArray[Any]:
        return renderer.apply(image, lens, framebuffers="final")["final"]

    found = picture.copy()
    direction: Any = None
    last = 1.0
    for _ in range(STEPS):
        residual = picture - apply(found)
        # The bloom is linear, so its pullback is the same for each image.
        slope = pullback({"final": residual})["image"]
        free = (found > 0) | (slope > 0)
        slope = np.where(free, slope, 0)
        square = float(np.vdot(slope, slope))
        if square == 0:
            break
        direction = slope if direction is None else slope + square / last * direction
        direction = np.where(free, direction, 0).astype(np.float32)
        moved = apply(direction)
        step = float(np.vdot(slope, direction)) / float(np.vdot(moved, moved))
        ahead = found + np.float32(step) * direction
        last = square
        if (ahead < 0).any():
            direction = None
        found = np.maximum(ahead, 0)
    return found


def main(path: str) -> None:
    """Write the picture, the cleaned image and the truth side by side."""
    truth = night()
    with vkbloom.Renderer() as renderer:
        picture = renderer.apply(truth, LENS, framebuffers="final")["final"]
        # Of the sensor.
        noise = np.random.default_rng(5).normal(scale=0.005, size=picture.shape)
        picture = (picture + noise).astype(np.float32)
        found = cleaned(renderer, picture, LENS)
    before, after = (float(np.abs(one - truth).mean()) for one in (picture, found))
    print(f"mean error: {before:.4f} with glare, {after:.4f} without")
    rows = np.concatenate([picture, found, truth], axis=1)
    vkbloom.write(path, np.clip(rows, 0, 1).repeat(3, axis=0).repeat(3, axis=1))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "glare_removal.png")
