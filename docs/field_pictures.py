"""Draw a lens over the field, for the page on it; called by conf.py."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom import psf
from vkbloom._io.srgb import encode_srgb

FRAME = 384, 256
Array = NDArray[np.float64]


def coma(u: float, v: float) -> Array:
    """Return a spot with a tail that points outwards, in a little colour."""
    y, x = np.mgrid[-20:21, -20:21]
    colours = []
    for shift in (-0.6, 0.0, 0.6):
        spots = [
            np.exp(-((x - far * u) ** 2 + (y - far * v) ** 2) / (2 * (1 + 0.15 * step) ** 2))
            / (1 + 0.15 * step) ** 3
            for step in range(12)
            for far in [step + shift * np.hypot(u, v) * 2]
        ]
        colours.append(np.sum(spots, axis=0) / np.sum(spots))
    return np.stack(colours, axis=-1)


def lights() -> NDArray[np.float32]:
    """Return lights in the dark, on a grid."""
    image = np.full((FRAME[1], FRAME[0], 3), 0.001, np.float32)
    for x in np.linspace(24, FRAME[0] - 25, 8).round().astype(int):
        for y in np.linspace(20, FRAME[1] - 21, 6).round().astype(int):
            image[y, x] = 8
    return image


def shown(image: NDArray[Any]) -> NDArray[np.uint8]:
    """Return an image as bytes in sRGB, of which the faint parts are lifted."""
    lifted = np.clip(image, 0, 1).astype(np.float64) ** 0.6
    return np.rint(255 * encode_srgb(lifted)).astype(np.uint8)


def write(folder: Path) -> None:
    """Write the pictures, and the text that shows them."""
    folder.mkdir(parents=True, exist_ok=True)
    lens = psf.Varying(function=coma)
    if "VKBLOOM_DOCS_SMALL" in os.environ:
        lens = psf.Varying(function=coma, tolerance=0.05)
    settings = vkbloom.Convolution(lens, composite="mix", intensity=1, format="rgba32float")
    glared = vkbloom.apply(lights(), settings)["final"]
    atlas = lens.array(FRAME)
    gap = np.full((FRAME[1], 8, 3), 40, np.uint8)
    both = np.concatenate([shown(atlas / atlas.max()), gap, shown(glared)], axis=1)
    vkbloom.write(folder / "lens.png", both)
    folder.with_suffix(".md").write_text(
        "![On the left the field drawn by `array`, on the right lights behind the lens]"
        f"({'/'.join((folder / 'lens.png').parts[-3:])})\n",
        encoding="utf-8",
    )
