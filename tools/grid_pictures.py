"""Draw the pictures of docs/grids.md: contact sheet and response curves of a grid of the saucer.

python tools/grid_pictures.py docs/pictures
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import vkbloom
from vkbloom import reductions


def main(folder: Path) -> None:
    """Write grid_sheet.png and grid_curves.png."""
    with vkbloom.Renderer("software") as renderer:
        dataset = renderer.grid(
            vkbloom.Scene.ufo(),
            vkbloom.Separable(),
            {
                "intensity": [0.5, 1.0, 2.0],
                "blur_scale": np.linspace(0.5, 4, 5),
                "tonemap": ["none", "aces"],
            },
            size=(480, 270),
            reduce={
                "mean": reductions.Mean(),
                "ssim": reductions.SSIM(against={"blur_scale": 0.5}),
            },
        )
    sheet = vkbloom.contact_sheet(dataset, "intensity", "blur_scale", width=200)
    (folder / "grid_sheet.png").write_bytes(sheet)
    curves = vkbloom.response_curves(dataset, "blur_scale", "intensity")
    curves.savefig(folder / "grid_curves.png", dpi=90)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
