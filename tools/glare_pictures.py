"""Draw docs/pictures/glare.jpg: the city of night_picture.py with each of `vkbloom.glares`.

And docs/pictures/glare_grid.jpg: a grid over two fields of a stage.
"""

from __future__ import annotations

import sys
from pathlib import Path

import night_picture
import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

import vkbloom
from vkbloom._views import pictures

COLUMNS, LABEL = 3, 22
LOOK = vkbloom.Pyramid(threshold=1.0, intensity=0.15, exposure=0.6, tonemap="agx", encoding="srgb")
# Bloom alone, the published stages, and all kinds of stages together.
SHOWN: dict[str, tuple[vkbloom.Glare, ...]] = {
    "without glare": (),
    **vkbloom.glares,
    "six streaks": (vkbloom.Streaks(threshold=4, fade=0.94),),
    "ghosts and a halo": (
        vkbloom.Ghosts(threshold=6, aberration=0.01),
        vkbloom.Halo(threshold=6, aberration=0.01),
    ),
    "streaks and dirt": (vkbloom.Streaks(threshold=4, fade=0.94), vkbloom.Dirt(strength=2)),
}


def main() -> None:
    """Write both pictures to the folder."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/pictures")
    image = night_picture.city()
    # A light near the centre, whose reflections lie in the picture.
    image[150:158, 500:508] = 400
    with vkbloom.Renderer("software") as renderer:
        shown = {
            name: level(renderer.apply(image, LOOK.replace(glare=stages))["final"])
            for name, stages in SHOWN.items()
        }
        settings = LOOK.replace(glare=(vkbloom.Streaks(threshold=4),))
        axes = {"glare.0.fade": [0.8, 0.94, 0.98], "glare.0.directions": [1, 4, 6]}
        grid = vkbloom.grid(image, settings, axes=axes, framebuffers="final", renderer=renderer)
    save(shown, folder / "glare.jpg")
    points = {
        f"fade {fade}, directions {count}": level(grid["final"].values[i, j])
        for i, fade in enumerate(axes["glare.0.fade"])
        for j, count in enumerate(axes["glare.0.directions"])
    }
    save(points, folder / "glare_grid.jpg")


def level(final: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return a picture of a third of the size in 8 bits."""
    height, width = (side // COLUMNS for side in final.shape[:2])
    cut = final[: height * COLUMNS, : width * COLUMNS, :3]
    small = cut.reshape(height, COLUMNS, width, COLUMNS, 3).mean((1, 3))
    return np.rint(255 * np.clip(small, 0, 1)).astype(np.uint8)


def save(shown: dict[str, NDArray[np.uint8]], path: Path) -> None:
    """Write a sheet of pictures with their names."""
    height, width, _ = next(iter(shown.values())).shape
    rows = -(-len(shown) // COLUMNS)
    sheet = np.full((rows * (height + LABEL), COLUMNS * width, 3), 24, np.uint8)
    labels = []
    for index, (name, picture) in enumerate(shown.items()):
        row, column = divmod(index, COLUMNS)
        top, left = row * (height + LABEL), column * width
        sheet[top : top + height, left : left + width] = picture
        labels.append((left + 6, top + height + 16, name))
    image = oiio.ImageBuf(pictures.labelled(sheet, labels, 15))
    image.specmod().attribute("CompressionQuality", 88)
    if not image.write(str(path)):
        raise SystemExit(f"{path}: {image.geterror()}")


if __name__ == "__main__":
    main()
