"""Make docs/pictures/night.jpg: a made-up city at night, without bloom and with it.

night_psf.jpg beside it has a part of the city with each preset that is a convolution.

The picture is computed here, from rectangles and random numbers: lights are up to 60 times as
bright as a white wall in the same exposure, as in an HDR photograph.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom._views import pictures

Image = NDArray[np.float32]

SIZE = (1280, 640)
HORIZON = 430
# Twice as large, then averaged: edges are smooth, as a lens has them.
SCALE = 2
WARM, COLD = np.array([(1.0, 0.62, 0.28), (0.62, 0.82, 1.0)], np.float32)
NEON = np.array([(1, 0.08, 0.25), (0.1, 0.9, 0.75), (0.35, 0.25, 1), (1, 0.5, 0.05)], np.float32)
SETTINGS = vkbloom.presets["bevy_natural"].replace(
    intensity=0.22, exposure=0.6, tonemap="agx", encoding="srgb"
)


def city() -> Image:
    """Return the picture before the bloom, (H, W, 3), linear."""
    random = np.random.default_rng(12)
    width, height, horizon = (SCALE * number for number in (*SIZE, HORIZON))
    image = np.zeros((height, width, 3), np.float32)
    down = np.linspace(0, 1, horizon, dtype=np.float32)[:, None, None]
    # The glow of the city in the haze above it.
    image[:horizon] = 0.004 + down**3 * np.array([0.10, 0.045, 0.05], np.float32)
    stars = random.integers(0, (horizon // 2, width), (260, 2))
    image[stars[:, 0], stars[:, 1]] += random.random((260, 1), np.float32) * 1.5
    for row in range(3):
        skyline(image, random, row)
    lamps(image, random)
    water(image, random)
    small = image.reshape(SIZE[1], SCALE, SIZE[0], SCALE, 3).mean((1, 3))
    # Noise of a sensor.
    return np.maximum(small + random.normal(0, 0.0015, small.shape), 0).astype(np.float32)


def skyline(image: Image, random: np.random.Generator, row: int) -> None:
    """Draw a row of buildings with windows; the nearest row is the darkest and the last."""
    horizon, width = SCALE * HORIZON, image.shape[1]
    left = -int(random.integers(0, 40))
    while left < width:
        wide = int(random.integers(46, 120)) * SCALE
        high = int(random.integers(90, 330) * (1 - 0.22 * row)) * SCALE
        right, top = left + wide - 6 * SCALE, horizon - high
        image[top:horizon, max(left, 0) : max(right, 0)] = (
            (0.02, 0.017, 0.026)
            if row
            else (
                0.034,
                0.024,
                0.034,
            )
        )
        colour = WARM if random.random() < 0.7 else COLD
        for y in range(top + 5 * SCALE, horizon - 12 * SCALE, 9 * SCALE):
            for x in range(max(left, 0) + 4 * SCALE, right - 6 * SCALE, 7 * SCALE):
                if random.random() < 0.22:
                    light = 0.4 * random.pareto(1.6) + 0.15
                    window = (slice(y, y + 5 * SCALE), slice(x, x + 3 * SCALE))
                    image[window] = colour * np.float32(min(light, 12))
        if random.random() < 0.35 and 0 < left < width - wide:
            sign(image, random, left + wide // 3, top + 20 * SCALE)
        left += wide


def sign(image: Image, random: np.random.Generator, x: int, y: int) -> None:
    """Hang an upright neon sign on a building."""
    light = NEON[random.integers(len(NEON))] * np.float32(random.uniform(14, 40))
    for part in range(int(random.integers(4, 9))):
        top = y + 12 * SCALE * part
        image[top : top + 8 * SCALE, x : x + 6 * SCALE] = light


def lamps(image: Image, random: np.random.Generator) -> None:
    """Set a row of street lamps along the quay."""
    horizon = SCALE * HORIZON
    image[horizon - 9 * SCALE : horizon] = (0.03, 0.022, 0.016)
    for x in range(20 * SCALE, image.shape[1], 52 * SCALE):
        image[horizon - 30 * SCALE : horizon, x : x + SCALE] = 0.01
        light = WARM * np.float32(random.uniform(35, 60))
        image[horizon - 33 * SCALE : horizon - 29 * SCALE, x - SCALE : x + 3 * SCALE] = light


def water(image: Image, random: np.random.Generator) -> None:
    """Mirror the city in rippled water, which takes light and draws reflections down."""
    horizon = SCALE * HORIZON
    rows = np.arange(image.shape[0] - horizon)
    columns = np.arange(image.shape[1])
    for row in rows:
        ripple = np.sin(row * 0.9) * 2 + np.sin(row * 0.31 + 1) * 4 + random.normal(0, 2.5)
        shift = np.rint(ripple * (0.4 + row / 120)).astype(int)
        source = horizon - 1 - int(row * 0.95 + abs(random.normal(0, 3 + row / 14)))
        reflected = image[max(source, 0), np.clip(columns + shift, 0, columns[-1])]
        image[horizon + row] = reflected * 0.34 + np.array([0.002, 0.003, 0.006], np.float32)


def draw_convolutions(renderer: vkbloom.Renderer, image: Image, target: Path) -> None:
    """Write a part of the picture without bloom and with each convolution, in two rows."""
    look = {"exposure": 0.6, "tonemap": "agx", "encoding": "srgb"}
    every: dict[str, vkbloom.Settings] = {"no bloom": vkbloom.Separable(bloom=False)}
    every |= {
        name: settings
        for name, settings in vkbloom.presets.items()
        if isinstance(settings, vkbloom.Convolution)
    }
    top, left, height, width = 190, 420, 290, 400
    sheet = np.ones((2 * height, 3 * width, 3), np.uint8)
    labels = []
    for index, (name, settings) in enumerate(every.items()):
        final = renderer.apply(image, settings.replace(**look), framebuffers=["final"])["final"]
        y, x = index // 3 * height, index % 3 * width
        part = np.clip(final[top : top + height, left : left + width], 0, 1)
        sheet[y : y + height, x : x + width] = np.rint(255 * part)
        labels.append((x + 8, y + 22, name))
    shown = pictures.labelled(sheet, labels, 17).astype(np.float32) / 255
    print(vkbloom.write(target, shown, encoding="none", quality=88))


def main() -> None:
    """Write the picture: the left half without bloom, the right half with it."""
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/pictures/night.jpg")
    image = city()
    with vkbloom.Renderer("software") as renderer:
        plain, bloom = (
            renderer.apply(image, settings, framebuffers=["final"])["final"]
            for settings in (SETTINGS.replace(bloom=False), SETTINGS)
        )
        draw_convolutions(renderer, image, target.with_name("night_psf.jpg"))
    middle = SIZE[0] // 2
    shown = np.concatenate([plain[:, :middle], bloom[:, middle:]], axis=1)
    shown[:, middle - 1 : middle + 1] = 1
    print(vkbloom.write(target, shown, encoding="none", quality=88))


if __name__ == "__main__":
    main()
