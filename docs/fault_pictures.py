"""Draw what each fault of the library does, for the page on faults; called by conf.py."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom._io.srgb import encode_srgb
from vkbloom.testing._laws.table import LAWS

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.plugin.faults import FAULTS, Bloom, Image

CELL = (192, 144)
GREY = 40
BACKDROP = 0.25


def lights(size: tuple[int, int] = (64, 48)) -> Image:
    """Return lights in the middle, at two edges and in a corner."""
    width, height = size
    image = np.zeros((height, width, 3), np.float32)
    for x, y, colour in (
        (width // 2 - 2, height // 2 - 2, (6, 4, 2)),
        (2, height // 2, (2, 4, 6)),
        (width - 4, 4, (6, 2, 2)),
        (0, height - 3, (3, 6, 3)),
    ):
        image[y : y + 3, x : x + 3] = colour
    return image


def image_for(law: str, words: str) -> Image:
    """Return an image whose bloom shows whether a law holds."""
    if law == "round":
        point = np.zeros((48, 64, 3), np.float32)
        point[24, 32] = 1.0
        return point
    if law == "jitter":
        thin = np.zeros((48, 64, 3), np.float32)
        thin[23:25, 8:56:5] = 3.0
        return thin
    is_odd = law == "sizes" or "last pixel" in words
    image = lights((61, 45) if is_odd else (64, 48))
    if law == "finite":
        image[24, 32] = np.nan if "nan" in words else np.inf
    return image * (200 if law in ("unclamped", "bounded_fireflies") else 1)


def draw(bloom: Bloom, law: str, words: str) -> Image:
    """Return what a bloom makes of an image that shows whether the law holds."""
    if law == "views":
        across = 0 if "upper" in words else 1
        views = [0.1 * lights((48, 48)), lights((48, 48))]
        both = np.concatenate(views, axis=across)
        corners = [(0, 0), (0, 48) if across == 0 else (48, 0)]
        blooms = [bloom(both, region=(*corner, 48, 48)) for corner in corners]
        return np.concatenate(blooms, axis=across)
    if law == "alpha":
        alpha = lights().any(axis=2, keepdims=True).astype(np.float32)
        alpha[:, 20:] /= 2
        found = bloom(np.concatenate([lights(), alpha], axis=2))
        return found[..., :3] + (1 - found[..., 3:]) * BACKDROP
    if law == "history":
        bloom(np.roll(lights(), -16, axis=1))
    elif "image before" in words or "bright image" in words:
        bloom(np.full((80, 96, 3), 6.0, np.float32))
        bloom(np.full((48, 64, 3), 6.0, np.float32))
    # What is not finite is shown white.
    return np.nan_to_num(bloom(image_for(law, words)), nan=6.0, posinf=6.0)


def tile(image: Image, brightest: float) -> NDArray[np.uint8]:
    """Return an image in sRGB, enlarged to the middle of a cell."""
    shown = encode_srgb(np.clip(image.astype(np.float64) / brightest, 0, 1))
    times = min(CELL[0] // image.shape[1], CELL[1] // image.shape[0])
    pixels = np.rint(255 * shown).astype(np.uint8).repeat(times, axis=0).repeat(times, axis=1)
    cell = np.full((CELL[1], CELL[0], 3), GREY, np.uint8)
    top, left = (CELL[1] - pixels.shape[0]) // 2, (CELL[0] - pixels.shape[1]) // 2
    cell[top : top + pixels.shape[0], left : left + pixels.shape[1]] = pixels
    return cell


def write(folder: Path) -> None:
    """Write a picture for each fault, and the text that shows them by law."""
    folder.mkdir(parents=True, exist_ok=True)
    text: list[str] = []
    gap = np.full((CELL[1], 8, 3), GREY, np.uint8)
    for law in LAWS:
        faults = {name: fault for name, fault in FAULTS.items() if fault.law == law}
        if faults:
            text += [f"## `{law}`\n", f"{LAWS[law].sentence}\n"]
        for name, fault in faults.items():
            right, wrong = (draw(make(), law, fault.words) for make in (fault.correct, fault.fault))
            off: Any = np.abs(wrong.astype(np.float64) - right)
            brightest, most = float(right.max()), float(off.max())
            tiles = [tile(right, brightest), gap, tile(wrong, brightest), gap, tile(off, most)]
            place = folder / f"{name.replace(' ', '_')}.png"
            vkbloom.write(place, np.concatenate(tiles, axis=1))
            text += [
                f"{name.capitalize()}; the difference is {brightest / most:.3g} times as bright:\n",
                f"![{name}: correct, with the fault, and the difference]"
                f"({'/'.join(place.parts[-3:])})\n",
            ]
    folder.with_suffix(".md").write_text("\n".join(text), encoding="utf-8")
