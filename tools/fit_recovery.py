"""Find random settings of four methods again, from their defaults, and print the table.

python tools/fit_recovery.py docs/fit_table.md

The targets are those of `vkbloom.reference`. Counted are fits whose varied fields are all within
1 % of the truth, and fits whose loss is at most 1e-3 of the one at the start.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom

SIDE = 256
# By start: ranges of the random numbers.
METHODS: list[tuple[vkbloom.Settings, dict[str, tuple[float, float]]]] = [
    (
        vkbloom.Pyramid(knee=0.5, threshold=1.0),
        {"threshold": (0.2, 4), "radius": (0.4, 3), "intensity": (0.05, 2)},
    ),
    (
        vkbloom.KinoBloom(),
        {"threshold": (0.2, 4), "radius": (1.2, 5), "intensity": (0.05, 2)},
    ),
    (
        vkbloom.UrpBloom(),
        {"threshold": (0.2, 4), "scatter": (0.1, 0.95), "intensity": (0.05, 2)},
    ),
    (
        vkbloom.Separable(knee=0.5, threshold=1.0),
        {"threshold": (0.2, 4), "blur_scale": (0.5, 3), "intensity": (0.05, 2)},
    ),
]


def scene(side: int = SIDE) -> NDArray[np.float32]:
    """Return a picture with light of all brightnesses, and lamps up to 20."""
    generator = np.random.default_rng(7)
    image = generator.random((side, side, 3)) ** 6 * 3
    for _ in range(24):
        y, x = generator.integers(0, side - 8, 2)
        height, width = generator.integers(1, 8, 2)
        image[y : y + height, x : x + width] += generator.random(3) * 20
    return image.astype(np.float32)


def row(
    renderer: vkbloom.Renderer,
    start: vkbloom.Settings,
    ranges: dict[str, tuple[float, float]],
    count: int,
) -> str:
    """Return the line of one method."""
    generator = np.random.default_rng(1)
    image = scene()
    near = small = 0
    calls, seconds = [], []
    for _ in range(count):
        values: dict[str, Any] = {
            name: float(np.exp(generator.uniform(*np.log(ends)))) for name, ends in ranges.items()
        }
        target = vkbloom.reference.apply(image, start.replace(**values))["final"]
        began = time.perf_counter()
        found = vkbloom.fit(
            image, target, start, list(ranges), framebuffer="final", renderer=renderer
        )
        seconds.append(time.perf_counter() - began)
        calls.append(found.calls)
        near += all(
            abs(getattr(found.settings, name) - value) <= 0.01 * value
            for name, value in values.items()
        )
        small += found.loss <= 1e-3 * found.start_loss
    cells = [
        f"`{type(start).__name__}`",
        ", ".join(f"`{name}`" for name in ranges),
        f"{near} of {count}",
        f"{small} of {count}",
        f"{median(calls):.0f}, at most {max(calls)}",
        f"{median(seconds):.1f}, at most {max(seconds):.1f}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Fit, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--adapter", default="software")
    parser.add_argument("--count", type=int, default=20)
    arguments = parser.parse_args()
    heads = ("method", "varied", "within 1 %", "1e-3 of the loss", "renders", "seconds")
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    with vkbloom.Renderer(arguments.adapter) as renderer:
        for start, ranges in METHODS:
            lines.append(row(renderer, start, ranges, arguments.count))
            print(lines[-1], flush=True)
        summary = renderer.info.summary
    arguments.path.write_text(
        f"On {summary}, {SIDE} x {SIDE}, float32.\n\n" + "\n".join(lines) + "\n"
    )


if __name__ == "__main__":
    main()
