"""Draw what a flare report measures, for its page; called by conf.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import vkbloom
from vkbloom.testing import FlareChart, flare

SIZE = (360, 240)
#: Age, and pixels per degree.
AGE, SCALE = 70, 12
CELL = (360, 240)
GREY = 128


def write(folder: Path) -> None:
    """Write the pictures of a report, and the text that shows them with its figures."""
    folder.mkdir(parents=True, exist_ok=True)
    eye = vkbloom.psf.cie_total(age=AGE)
    lens = vkbloom.Convolution(eye, composite="mix", pixels_per_degree=SCALE)
    found = flare(
        lens, chart=FlareChart(size=SIZE), pixels_per_degree=SCALE, name=f"an eye of {AGE} years"
    )
    cells = []
    for pixels in found.pictures.values():
        cell = np.full((CELL[1], CELL[0], 3), GREY, np.uint8)
        cell[: pixels.shape[0], : pixels.shape[1]] = pixels
        cells += [cell, np.full((CELL[1], 8, 3), GREY, np.uint8)]
    place = folder / "report.png"
    vkbloom.write(place, np.concatenate(cells[:-1], axis=1))
    text = [
        f"![{'; '.join(found.pictures)}]({'/'.join(place.parts[-3:])})\n",
        f"A report of the glare of {found.name}, `psf.cie_total`. From the left: "
        f"{'; '.join(found.pictures)}.\n",
        *found.to_markdown().splitlines()[2:],
    ]
    folder.with_suffix(".md").write_text("\n".join((*text, "")), encoding="utf-8")
