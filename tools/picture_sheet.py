"""Write pictures in rows as one picture, for pages and for looking."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("agg")
from matplotlib import pyplot as plt


def write_sheet(path: Path, tiles: Sequence[tuple[NDArray[np.uint8], str]], columns: int) -> None:
    """Write pictures in rows, with their names below, for light and dark pages."""
    height, width = tiles[0][0].shape[:2]
    rows, margin, name = -(-len(tiles) // columns), 6, 26
    size = columns * (width + margin) + margin, rows * (height + name) + margin
    figure = plt.figure(figsize=(size[0] / 100, size[1] / 100), facecolor="#222222")
    for index, (tile, text) in enumerate(tiles):
        x = margin + index % columns * (width + margin)
        y = size[1] - margin - index // columns * (height + name)
        # Pixel by pixel.
        figure.figimage(tile, x, y - height)
        place = (x + width / 2) / size[0], (y - height - name / 2) / size[1]
        figure.text(*place, text, color="white", fontsize=12, ha="center", va="center")
    figure.savefig(path, dpi=100, facecolor="#222222")
    plt.close(figure)
