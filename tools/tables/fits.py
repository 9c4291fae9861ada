"""Tables of searches for settings."""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import numpy as np
import screenshots as pairs
from cells import table
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom

SIDE = 256
SIZE = (240, 135)
CALLS = 40
# By start: ranges of the random numbers.
METHODS: list[tuple[vkbloom.Settings, dict[str, tuple[float, float]]]] = [
    (
        vkbloom.Pyramid(knee=0.5, threshold=1.0),
        {"threshold": (0.2, 4), "radius": (0.4, 3), "intensity": (0.05, 2)},
    ),
    (vkbloom.KinoBloom(), {"threshold": (0.2, 4), "radius": (1.2, 5), "intensity": (0.05, 2)}),
    (vkbloom.UrpBloom(), {"threshold": (0.2, 4), "scatter": (0.1, 0.95), "intensity": (0.05, 2)}),
    (
        vkbloom.Separable(knee=0.5, threshold=1.0),
        {"threshold": (0.2, 4), "blur_scale": (0.5, 3), "intensity": (0.05, 2)},
    ),
]


def scene(side: int) -> NDArray[np.float32]:
    """Return a picture with light of all brightnesses, and lamps up to 20."""
    generator = np.random.default_rng(7)
    image = generator.random((side, side, 3)) ** 6 * 3
    for _ in range(24):
        y, x = generator.integers(0, side - 8, 2)
        height, width = generator.integers(1, 8, 2)
        image[y : y + height, x : x + width] += generator.random(3) * 20
    return image.astype(np.float32)


def recovery(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Find random settings of four methods again, from their defaults.

    The targets are those of `vkbloom.reference`. Counted are fits whose varied fields are all
    within 1 % of the truth, and fits whose loss is at most 1e-3 of the one at the start.
    """
    rows, count = [], 1 if quick else 20
    image = scene(64 if quick else SIDE)
    for start, ranges in METHODS:
        generator = np.random.default_rng(1)
        near = small = 0
        calls, seconds = [], []
        for _ in range(count):
            values: dict[str, Any] = {
                name: float(np.exp(generator.uniform(*np.log(ends))))
                for name, ends in ranges.items()
            }
            target = vkbloom.reference.apply(image, start.replace(**values))["final"]
            began = time.perf_counter()
            found = vkbloom.fit(image, target, start, list(ranges), renderer=renderer)
            seconds.append(time.perf_counter() - began)
            calls.append(found.calls)
            near += all(
                abs(getattr(found.settings, name) - value) <= 0.01 * value
                for name, value in values.items()
            )
            small += found.loss <= 1e-3 * found.start_loss
        rows.append(
            [
                f"`{type(start).__name__}`",
                ", ".join(f"`{name}`" for name in ranges),
                f"{near} of {count}",
                f"{small} of {count}",
                f"{median(calls):.0f}, at most {max(calls)}",
                f"{median(seconds):.1f}, at most {max(seconds):.1f}",
            ]
        )
    head = ["method", "varied", "within 1 %", "1e-3 of the loss", "renders", "seconds"]
    return table(head, rows)


def screenshots(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Fit pairs of 8-bit pictures."""
    head = ["photograph", "target", "saturated", "found: threshold, intensity", "explained"]
    return table([*head, "verdict"], pairs.rows(renderer, quick))


def translations(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Translate each preset into each other method."""
    # One preset of each method.
    kinds: dict[type, str] = {}
    for name, settings in vkbloom.presets.items():
        kinds.setdefault(type(settings), name)
    rows, closest = [], []
    for source, settings in tqdm(vkbloom.presets.items()):
        found = {
            name: vkbloom.translate(
                settings,
                vkbloom.presets[name],
                size=SIZE,
                renderer=renderer,
                max_calls=2 if quick else CALLS,
            )
            for kind, name in kinds.items()
            if kind is not type(settings)
        }
        cells = (f"{found[name].loss:.2g}" if name in found else "" for name in kinds.values())
        rows.append([f"`{source}`", *cells])
        best = min(found, key=lambda name: found[name].loss)
        values = (
            f"{name} {value:.3g}"
            for name in found[best].vary
            if isinstance(value := getattr(found[best].settings, name), int | float)
        )
        closest.append([f"`{source}`", f"`{best}`", ", ".join(values)])
    matrix = table(["from / to", *(f"`{name}`" for name in kinds.values())], rows)
    return f"{matrix}\n{table(['preset', 'closest', 'with'], closest)}"
