"""Draw photographs and graphics before and after the preset photo, for the page on presets.

Called by conf.py.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage import data

import vkbloom

sys.path.insert(0, str(Path(__file__).parents[1]))
from tools.look_sheet import apply_look, levels_of
from tools.picture_sheet import write_sheet

from vkbloom._views import pictures

Image = NDArray[np.uint8]
CELL = (360, 240)


def room() -> Image:
    """Return bright windows in a dark wall, with a soft gradient of light."""
    down, across = np.mgrid[:480, :720].astype(np.float32)
    wall = 40 + 60 * np.exp(-np.hypot(across - 360, down - 200) / 250)
    image = wall[..., None] * np.array([1, 0.9, 0.8], np.float32)
    for left in (120, 310, 500):
        image[90:300, left : left + 110] = 254
        image[192:198, left : left + 110] = image[90:300, left + 52 : left + 58] = 50
    return image.astype(np.uint8)


def saucer() -> Image:
    """Return the built-in scene without bloom, as 8 bits."""
    plain = vkbloom.Separable(exposure=1.0, tonemap="aces", encoding="srgb", bloom=False)
    with vkbloom.Renderer("software") as renderer:
        drawn = renderer.render(
            vkbloom.Scene.ufo(), plain, (720, 480), shading="deferred", framebuffers="final"
        )
    return pictures.picture(drawn["final"], "final", encoding="srgb")


def photographs() -> dict[str, Image]:
    """Return ten photographs by name, most of them scikit-image's."""
    found = {
        "rocket": data.rocket()[140:],
        "room (made up)": room(),
        "saucer (rendered)": saucer(),
        "galaxies": data.hubble_deep_field(),
        "astronaut": data.astronaut()[:340],
        "coffee": data.coffee(),
        "motorcycle": data.stereo_motorcycle()[0],
        "cat": data.chelsea(),
        "retina": data.retina()[200:1150],
        "moon": np.repeat(data.moon()[:340, :, None], 3, axis=2),
    }
    return {name: np.ascontiguousarray(image) for name, image in found.items()}


def graphics() -> dict[str, Image]:
    """Return ten graphics by name: flat and bright colours, as in drawings and user interfaces."""
    down, across = np.mgrid[: CELL[1], : CELL[0]]
    found: dict[str, Image] = {}
    named: tuple[tuple[str, tuple[int, int, int], list[tuple[int, int, int]]], ...] = (
        ("orange on black", (0, 0, 0), [(255, 128, 0)]),
        ("cream poster", (255, 245, 220), [(200, 60, 40), (40, 90, 140)]),
        ("light blue window", (200, 230, 255), [(255, 255, 255), (30, 60, 90)]),
        ("pastels", (40, 40, 48), [(255, 200, 200), (200, 255, 220), (220, 210, 255)]),
        ("primaries", (0, 0, 0), [(255, 0, 0), (0, 255, 0), (0, 0, 255)]),
        ("secondaries", (16, 16, 16), [(255, 255, 0), (0, 255, 255), (255, 0, 255)]),
        ("neon on night", (10, 8, 30), [(255, 20, 147), (57, 255, 20), (0, 240, 255)]),
        ("buttons on white", (255, 255, 255), [(255, 140, 0), (0, 150, 255), (90, 200, 90)]),
    )
    for name, ground, colours in named:
        image = np.full((*down.shape, 3), ground, np.uint8)
        for index, colour in enumerate(colours):
            middle = CELL[0] * (index + 0.5) / len(colours)
            image[(np.abs(down - CELL[1] / 2) < 50) & (np.abs(across - middle) < 40)] = colour
        found[name] = image
    hue, light = (across / CELL[0])[..., None], (down / (CELL[1] - 1))[..., None]
    wheel = np.clip(np.abs((hue * 6 + np.array([0, 4, 2])) % 6 - 3) - 1, 0, 1)
    found["hues to white"] = np.uint8(255 * (1 - (1 - wheel) * light))
    found["sky to sun"] = np.uint8(np.array([80, 140, 220]) + light * np.array([175, 60, -140]))
    return found


def fill(levels: NDArray[Any]) -> Image:
    """Return the middle of a picture, at the size of a cell."""
    height, width = levels.shape[:2]
    scale = max(CELL[0] / width, CELL[1] / height)
    size = (max(CELL[0], round(width * scale)), max(CELL[1], round(height * scale)))
    small = pictures.resize(levels.astype(np.float32), *size)
    top, left = (size[1] - CELL[1]) // 2, (size[0] - CELL[0]) // 2
    middle = small[top : top + CELL[1], left : left + CELL[0]]
    return np.rint(middle).clip(0, 255).astype(np.uint8)


def draw(images: dict[str, Image], folder: Path, path: Path) -> None:
    """Write a sheet of pairs: as they are, and as the command without options makes them."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [
        vkbloom.write(folder / f"{index}.png", one) for index, one in enumerate(images.values())
    ]
    made = apply_look(files, "photo", folder / "after")
    tiles = []
    for name, before, after in zip(images, files, made, strict=True):
        tiles += [(fill(levels_of(before)), name), (fill(levels_of(after)), "with bloom")]
    write_sheet(path, tiles, 4)


def write(folder: Path) -> None:
    """Write both sheets, and the text that shows them."""
    text = []
    for name, images in (("photographs", photographs()), ("graphics", graphics())):
        draw(images, folder / name, folder / f"{name}.jpg")
        place = f"{folder.parent.name}/{folder.name}/{name}.jpg"
        text.append(f"![Ten {name}, before and after]({place})\n")
    folder.with_suffix(".md").write_text("\n".join(text), encoding="utf-8")
