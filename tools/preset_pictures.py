#!/usr/bin/env python3
"""Draw the bloom of one bright point with each preset, side by side, for docs/presets.md.

The point has 3 x 3 pixels of 1000 in the middle of a black 640 x 360 frame, since KinoBloom removes
a single pixel. The picture shows a square around the point, in a logarithmic scale: white is the
brightest pixel of the bloom, black is 10^-5 of it or less.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

import vkbloom

FRAME = (640, 360)
SIDE = 300  # of the square shown, in pixels
GAP = 6
LABEL = 26
COLUMNS = 4
DECADES = 5


def spread(renderer: vkbloom.Renderer, settings: vkbloom.Settings) -> NDArray[np.float32]:
    """Return the bloom of the point, (SIDE, SIDE)."""
    width, height = FRAME
    image = np.zeros((height, width, 3), np.float32)
    y, x = height // 2, width // 2
    image[y - 1 : y + 2, x - 1 : x + 2] = 1000
    bloom = renderer.apply(image, settings.replace(format="rgba32float"))["bloom"]
    top, left = (height - SIDE) // 2, (width - SIDE) // 2
    cut: NDArray[np.float32] = bloom[top : top + SIDE, left : left + SIDE, 0]
    return cut


def grey(bloom: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the bloom on the logarithmic scale, as 0..1."""
    with np.errstate(divide="ignore"):
        decades = np.log10(np.maximum(bloom, 0) / bloom.max())
    return np.clip(1 + decades / DECADES, 0, 1).astype(np.float32)


def draw(pictures: dict[str, NDArray[np.float32]], path: Path) -> None:
    """Write the pictures as a labelled grid."""
    rows = -(-len(pictures) // COLUMNS)
    width = COLUMNS * (SIDE + GAP) + GAP
    height = rows * (SIDE + LABEL + GAP) + GAP
    buffer = oiio.ImageBuf(oiio.ImageSpec(width, height, 1, "float"))
    oiio.ImageBufAlgo.fill(buffer, (0.25,))
    for index, (name, picture) in enumerate(pictures.items()):
        left = GAP + index % COLUMNS * (SIDE + GAP)
        top = GAP + index // COLUMNS * (SIDE + LABEL + GAP)
        roi = oiio.ROI(left, left + SIDE, top + LABEL, top + LABEL + SIDE)
        buffer.set_pixels(roi, picture[..., np.newaxis])
        if not oiio.ImageBufAlgo.render_text(buffer, left, top + 20, name, 20, "", (1.0,)):
            raise SystemExit(f"the label {name} cannot be drawn: {buffer.geterror()}")
    # 32 levels of grey show the shape and keep the file small.
    levels = np.round(buffer.get_pixels("float") * 31) / 31
    out = oiio.ImageBuf((np.clip(levels, 0, 1) * 255).round().astype(np.uint8))
    path.parent.mkdir(parents=True, exist_ok=True)
    if not out.write(str(path)):
        raise SystemExit(f"{path}: {out.geterror()}")


def main() -> None:
    """Draw all presets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", nargs="?", type=Path, default="docs/pictures/presets.png")
    parser.add_argument("--adapter", default="software")
    arguments = parser.parse_args()
    with vkbloom.Renderer(arguments.adapter) as renderer:
        pictures = {
            name: grey(spread(renderer, settings)) for name, settings in vkbloom.presets.items()
        }
    draw(pictures, arguments.path)


if __name__ == "__main__":
    main()
