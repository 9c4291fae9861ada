"""Measure stability and resolution of each preset, and write the tables of docs/measured.md.

python tools/steadiness_tables.py docs

Takes about five minutes on two cores.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom
from vkbloom import testing

# Half, full and double.
SIZES = ((160, 90), (320, 180), (640, 360))
PATH, STEPS = 16, 1.5
# The sum of the moving light. As much as is above every threshold where it falls on four pixels.
LIGHT = 1000.0
# 720p, 1080p, 4K.
SCALES = (1.0, 1.5, 3.0)
FRAME = (1280, 720)
# Change of both radii, as a share of their mean, that a preset keeps its look with.
KEPT = 0.1
LAMP = 100.0
# Side of the lamp as a share of the height: four pixels at 720p.
LAMP_SIDE = 1 / 180


def bloom_of(
    renderer: vkbloom.Renderer, settings: vkbloom.Settings
) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Return the bloom alone, as a callable of grey images, which the probe makes faster."""

    def bloom(image: NDArray[Any]) -> NDArray[Any]:
        grey = np.repeat(image, 3, axis=2)
        return renderer.apply(grey, settings, framebuffers="bloom")["bloom"][:, :, :1]

    return bloom


def shown(numbers: Iterable[float]) -> str:
    """Return the figures of one cell, to two digits, and what is nearly nothing as 0."""
    texts = ["none" if math.isnan(number) else f"{float(f'{number:.2g}'):g}" for number in numbers]
    return " / ".join("0" if "e-" in text or text.startswith("0.00") else text for text in texts)


def stability_table(renderer: vkbloom.Renderer) -> str:
    """Return the table of moving lights."""
    names = ("ripple", "jitter", "flicker", "growth")
    rows = [["preset", "ripple, %", "jitter, pixels", "flicker, %", "growth, %"], ["---"] * 5]
    for name, settings in tqdm(vkbloom.presets.items(), "stability"):
        exact = settings.replace(format="rgba32float")
        found = [
            testing.stability(
                bloom_of(renderer, exact),
                texel=PATH,
                steps=STEPS,
                probe=testing.Probe(size=size, channels=1, value=LIGHT),
            )
            for size in SIZES
        ]
        unit = {name: 1 if name == "jitter" else 100 for name in names}
        cells = [shown(unit[name] * getattr(one, name) for one in found) for name in names]
        rows.append([f"`{name}`", *cells])
    return table(rows)


def resolution_table(renderer: vkbloom.Renderer) -> str:
    """Return the table of one scene at several sizes."""
    rows = [["preset", "50 % within, %", "90 % within, %", "peak, %", "keeps"], ["---"] * 5]
    probe = testing.Probe(size=FRAME, channels=1, dtype="float16", value=LAMP)
    for name, settings in tqdm(vkbloom.presets.items(), "resolution"):
        found = testing.resolution_response(
            bloom_of(renderer, settings), SCALES, light=LAMP_SIDE, probe=probe
        )
        cells = [shown(100 * values) for values in (found.r50, found.r90, found.peak)]
        kept = all(np.ptp(radii) < KEPT * radii.mean() for radii in (found.r50, found.r90))
        rows.append([f"`{name}`", *cells, "yes" if kept else "no"])
    return table(rows)


def table(rows: list[list[str]]) -> str:
    """Return rows as Markdown."""
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def main() -> None:
    """Measure, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--adapter", default="software")
    arguments = parser.parse_args()
    with vkbloom.Renderer(arguments.adapter) as renderer:
        for name, text in (
            ("stability_table.md", stability_table(renderer)),
            ("resolution_table.md", resolution_table(renderer)),
        ):
            (arguments.folder / name).write_text(f"On {renderer.info.summary}.\n\n{text}")


if __name__ == "__main__":
    main()
