"""Measure gain, spread and cost of each preset, and write the table of docs/measured.md.

python tools/measured_table.py docs/measured_table.md

The cost is wall-clock time, so run nothing else on the machine meanwhile.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

import vkbloom

FRAME = (1280, 720)
# Above every threshold, and below the values that Filament compresses. 3 x 3 pixels, since
# KinoBloom removes a single pixel as a firefly.
VALUE = 100.0
FLAT = 10.0
SHARES = (0.5, 0.9)


def spread(bloom: NDArray[np.float64], light: float) -> tuple[float, list[float]]:
    """Return the share of a light that is in its bloom, and the radii that contain parts of it."""
    height, width = bloom.shape
    y, x = np.mgrid[:height, :width]
    radius = np.hypot(y - height // 2, x - width // 2).ravel()
    order = np.argsort(radius)
    held = np.cumsum(bloom.ravel()[order])
    radii = [float(radius[order][np.searchsorted(held, share * held[-1])]) for share in SHARES]
    return float(held[-1] / light), radii


def cost(renderer: vkbloom.Renderer, settings: vkbloom.Settings, rounds: int) -> float:
    """Return the seconds of one call; each has another image than the one before."""
    generator = np.random.default_rng(0)
    images = [
        (generator.random((FRAME[1], FRAME[0], 3)) ** 8 * 10).astype(np.float16) for _ in range(2)
    ]
    seconds = []
    for index in range(rounds + 3):
        began = time.perf_counter()
        renderer.apply(images[index % 2], settings, framebuffers=["final"])
        seconds.append(time.perf_counter() - began)
    return median(seconds[3:])


def row(renderer: vkbloom.Renderer, name: str, settings: vkbloom.Settings, rounds: int) -> str:
    """Return one line of the table."""
    exact = settings.replace(format="rgba32float")
    point = np.zeros((FRAME[1], FRAME[0], 3), np.float32)
    y, x = FRAME[1] // 2, FRAME[0] // 2
    point[y - 1 : y + 2, x - 1 : x + 2] = VALUE
    frames = renderer.apply(point, exact)
    share, radii = spread(frames["bloom"][:, :, 0].astype(np.float64), 9 * VALUE)
    # Another image before, so that every pass runs and is counted.
    flat = renderer.apply(np.full_like(point, FLAT), exact)
    gain = float(flat["bloom"][y, x, 0]) / FLAT
    milliseconds = 1e3 * cost(renderer, settings, rounds)
    cells = [
        f"`{name}`",
        f"{gain:.3g}",
        f"{settings.intensity * gain:.3g}" if settings.composite == "add" else settings.composite,
        f"{share:.3g}",
        *(f"{radius:.0f}" for radius in radii),
        str(len(flat.timings)),
        f"{milliseconds:.1f}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Measure, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--adapter", default="software")
    parser.add_argument("--rounds", type=int, default=15)
    arguments = parser.parse_args()
    with vkbloom.Renderer(arguments.adapter) as renderer:
        rows = [
            row(renderer, name, settings, arguments.rounds)
            for name, settings in vkbloom.presets.items()
        ]
        summary = renderer.info.summary
    heads = (
        "preset",
        "gain",
        "added",
        "light of a point",
        *(f"{share:.0%} within" for share in SHARES),
        "passes",
        "ms",
    )
    text = f"On {summary}, {FRAME[0]} x {FRAME[1]}, half floats.\n\n"
    text += f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}\n" + "\n".join(rows) + "\n"
    arguments.path.write_text(text)


if __name__ == "__main__":
    main()
