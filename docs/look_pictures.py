"""Draw photographs before and after each look, for the page on looks; called by conf.py."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from skimage import data, transform

import vkbloom

sys.path.insert(0, str(Path(__file__).parents[1]))
from tools.look_sheet import LOOKS, apply_look, levels_of, measure

from vkbloom._presets.named_settings import PRESETS

#: By what they show: the name in scikit-image, and the first row of what is shown.
PHOTOGRAPHS = {
    "a launch pad": ("rocket", 0),
    "a cup": ("coffee", 0),
    "galaxies": ("hubble_deep_field", 0),
    "an astronaut": ("astronaut", 0),
}
CELL = (240, 160)


def cell(path: Path, row: int) -> NDArray[np.float64]:
    """Return a part of a picture with the sides of a cell, as linear light."""
    image = vkbloom.read(path)[..., :3]
    height = image.shape[1] * CELL[1] // CELL[0]
    return transform.resize(image[row : row + height], CELL[::-1], anti_aliasing=True)


def write(folder: Path, *, small: bool = False) -> None:
    """Write a picture of each look, and the text that shows them."""
    step = 4 if small else 1
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{name}.png" for name, _ in PHOTOGRAPHS.values()]
    for file in files:
        vkbloom.write(file, np.ascontiguousarray(getattr(data, file.stem)()[::step, ::step]))
    rows = [row for _, row in PHOTOGRAPHS.values()]
    before = np.concatenate([*map(cell, files, rows)], axis=1)
    text: list[str] = []
    for look in LOOKS:
        made = apply_look(files, look, folder / look)
        changes = [measure(*map(levels_of, pair)) for pair in zip(files, made, strict=True)]
        white = max(0.0, *(one.white for one in changes))
        after = np.concatenate([*map(cell, made, rows)], axis=1)
        place = folder / f"{look}.jpg"
        gap = np.ones((6, before.shape[1], 3))
        sheet = np.concatenate([before, gap, after]).astype(np.float32)
        vkbloom.write(place, sheet, quality=90)
        text += [
            f"### {look}\n",
            f"{PRESETS[look].what[:1].upper()}{PRESETS[look].what[1:]}.\n",
            f"```sh\nvkbloom apply photo.jpg bloom.jpg --preset {look}\n```\n",
            f"![{', '.join(PHOTOGRAPHS)}: above as they are, below with {look}]"
            f"({'/'.join(place.parts[-3:])})\n",
            "Pixels that differ by more than 4 levels of 255: "
            + ", ".join(
                f"{name} {change.seen:.0%}"
                for name, change in zip(PHOTOGRAPHS, changes, strict=True)
            )
            + f". Pixels that became white: at most {white:.1%}.\n",
        ]
    folder.with_suffix(".md").write_text("\n".join(text), encoding="utf-8")
