"""Draw photographs and graphics before and after ``vkbloom apply``, for the docs and README.md.

python tools/photo_sheet.py docs/pictures [Desk.exr]

The photographs are scikit-image's; the HDR photograph is of the OpenEXR collection and is developed
to 8 bits. photos.jpg has all, photo.jpg a part of the city, graphics.jpg ten made-up graphics.
The printed columns: the most that a value becomes darker, the mean change, and the median and the
99th percentile of the changes of hue in degrees.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner
from numpy.typing import NDArray
from skimage import data

import vkbloom
from vkbloom._cli.program import program
from vkbloom._views import pictures

sys.path.insert(0, str(Path(__file__).parent))
from night_picture import city

Image = NDArray[np.uint8]
HEIGHT, WIDTH, LABEL, GAP = 240, 360, 30, 6
LOOK: dict[str, Any] = {"tonemap": "aces", "encoding": "srgb", "bloom": False}


def room() -> Image:
    """Return bright windows in a dark wall, with a soft gradient of light."""
    down, across = np.mgrid[:480, :720].astype(np.float32)
    wall = 40 + 60 * np.exp(-np.hypot(across - 360, down - 200) / 250)
    image = wall[..., None] * np.array([1, 0.9, 0.8], np.float32)
    for left in (120, 310, 500):
        image[90:300, left : left + 110] = 254
        image[192:198, left : left + 110] = image[90:300, left + 52 : left + 58] = 50
    return image.astype(np.uint8)


def developed(image: NDArray[Any], stops: float) -> Image:
    """Return an HDR picture as 8 bits."""
    with vkbloom.Renderer("software") as renderer:
        plain = vkbloom.Separable(exposure=stops, **LOOK)
        final = renderer.apply(image, plain, framebuffers=["final"])["final"][..., :3]
    return np.rint(255 * np.clip(final.astype(np.float32), 0, 1)).astype(np.uint8)


def photographs(hdr: list[str]) -> dict[str, Image]:
    """Return the photographs by name."""
    with vkbloom.Renderer("software") as renderer:
        lit = renderer.render(vkbloom.Scene.ufo(), None, (720, 480), shading="deferred")["scene"]
    found = {
        "rocket": data.rocket(),
        "city (made up)": developed(city(), 0.0),
        "room (made up)": room(),
        "scene (rendered)": developed(lit, 1.0),
        "galaxies": data.hubble_deep_field(),
        "astronaut": data.astronaut(),
        "coffee": data.coffee(),
        "cat": data.chelsea(),
        "moon": np.repeat(data.moon()[..., None], 3, axis=2),
    }
    for name in hdr:
        found[f"{Path(name).stem} (HDR, developed)"] = developed(vkbloom.read(name), -1.0)
    return found


def graphics() -> dict[str, Image]:
    """Return ten graphics by name: flat and bright colours, as in drawings and user interfaces."""
    size = (240, 360, 3)
    down, across = np.mgrid[:240, :360]
    found = {}
    for name, ground, shapes in (
        ("orange on black", (0, 0, 0), [(255, 128, 0)]),
        ("cream poster", (255, 245, 220), [(200, 60, 40), (40, 90, 140)]),
        ("light blue window", (200, 230, 255), [(255, 255, 255), (30, 60, 90)]),
        ("pastels", (40, 40, 48), [(255, 200, 200), (200, 255, 220), (220, 210, 255)]),
        ("primaries", (0, 0, 0), [(255, 0, 0), (0, 255, 0), (0, 0, 255)]),
        ("secondaries", (16, 16, 16), [(255, 255, 0), (0, 255, 255), (255, 0, 255)]),
        ("neon on night", (10, 8, 30), [(255, 20, 147), (57, 255, 20), (0, 240, 255)]),
        ("buttons on white", (255, 255, 255), [(255, 140, 0), (0, 150, 255), (90, 200, 90)]),
    ):
        image = np.full(size, ground, np.uint8)
        for index, colour in enumerate(shapes):
            middle = 360 * (index + 0.5) / len(shapes)
            image[(np.abs(down - 120) < 50) & (np.abs(across - middle) < 40)] = colour
        found[name] = image
    hue = (across / 360)[..., np.newaxis]
    wheel = np.clip(np.abs((hue * 6 + np.array([0, 4, 2])) % 6 - 3) - 1, 0, 1)
    found["hues to white"] = np.uint8(255 * (1 - (1 - wheel) * (down / 239)[..., np.newaxis]))
    found["sky to sun"] = np.uint8(
        np.array([80, 140, 220]) + (down / 239)[..., np.newaxis] * np.array([175, 60, -140])
    )
    return found


def hue_changes(pair: tuple[Image, Image]) -> NDArray[np.float64]:
    """Return how far hues turn in degrees, where a colour is bright and has a hue."""
    before, after = (one.astype(np.float64) / 255 for one in pair)
    has_hue = (before.max(axis=2) > 0.9) & (before.max(axis=2) - before.min(axis=2) > 0.1)
    angles = [
        np.arctan2(
            np.sqrt(3) * (one[..., 1] - one[..., 2]), 2 * one[..., 0] - one[..., 1] - one[..., 2]
        )
        for one in (before, after)
    ]
    turned = np.degrees(angles[1] - angles[0])[has_hue]
    return np.abs((turned + 180) % 360 - 180) if turned.size else np.zeros(1)


def after(image: Image, folder: Path) -> Image:
    """Return what the command makes of a photograph without options."""
    vkbloom.write(folder / "a.png", np.ascontiguousarray(image))
    words = ["apply", str(folder / "a.png"), str(folder / "b.png")]
    result = CliRunner().invoke(program, words)
    if result.exit_code:
        raise SystemExit(result.output)
    final = vkbloom.read(folder / "b.png")[..., :3]
    encoded = np.where(final <= 0.0031308, 12.92 * final, 1.055 * final ** (1 / 2.4) - 0.055)
    return np.rint(255 * np.clip(encoded, 0, 1)).astype(np.uint8)


def fitted(image: Image, height: int, width: int) -> NDArray[np.float32]:
    """Return the middle of an image at a size."""
    rows, columns = image.shape[:2]
    scale = max(height / rows, width / columns)
    small = pictures.resized(image.astype(np.float32), *pictures.scaled(columns, rows, scale))
    top, left = (small.shape[0] - height) // 2, (small.shape[1] - width) // 2
    return small[top : top + height, left : left + width]


def draw(images: dict[str, Image], path: Path) -> dict[str, tuple[Image, Image]]:
    """Write a sheet of all pairs, print their figures, and return them."""
    rows = -(-len(images) // 2)
    sheet = np.full((rows * (HEIGHT + LABEL), 4 * WIDTH + 3 * GAP, 3), 24, np.uint8)
    labels, pairs = [], {}
    with tempfile.TemporaryDirectory() as temporary:
        for index, (name, image) in enumerate(images.items()):
            pair = pairs[name] = image, after(image, Path(temporary))
            top, left = index // 2 * (HEIGHT + LABEL), index % 2 * 2 * (WIDTH + GAP)
            for place, one in enumerate(pair):
                begin = left + place * (WIDTH + GAP)
                tile = np.rint(fitted(one, HEIGHT, WIDTH)).clip(0, 255).astype(np.uint8)
                sheet[top : top + HEIGHT, begin : begin + WIDTH] = tile
            labels.append((left + 8, top + HEIGHT + 22, name))
            changes, hues = pair[1].astype(int) - pair[0], hue_changes(pair)
            print(
                f"| {name} | {max(0, -changes.min())} | {changes.mean():+.2f} | "
                f"{np.median(hues):.1f} | {np.percentile(hues, 99):.1f} |"
            )
    vkbloom.write(path, pictures.labelled(sheet, labels, 20), quality=86)
    return pairs


def main(folder: Path, hdr: list[str]) -> None:
    """Write the pictures."""
    draw(graphics(), folder / "graphics.jpg")
    pairs = draw(photographs(hdr), folder / "photos.jpg")
    part = [one[120:520, 320:860] for one in pairs["city (made up)"]]
    vkbloom.write(folder / "photo.jpg", np.concatenate(part, axis=1), quality=88)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
