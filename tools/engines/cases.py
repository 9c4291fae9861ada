"""The table of cases: images of our own, and parameters of each engine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

TYPES: Final = (
    "bloom",
    "ghosts",
    "streaks",
    "fog_glow",
    "simple_star",
    "sun_beams",
    "kernel",
)
QUALITIES: Final = ("high", "medium", "low")
#: Width and height: odd, even, with negative values, wide, tall, larger.
SIZES: Final = {
    "odd": (37, 29),
    "even": (48, 32),
    "negative": (41, 30),
    "wide": (66, 19),
    "tall": (21, 51),
    "large": (97, 61),
    "small": (19, 14),
}


def image(name: str) -> np.ndarray:
    """Return an image (h, w, 3) of float32: noise, and a few bright blocks."""
    width, height = SIZES[name]
    random = np.random.default_rng([*map(ord, name)])
    picture = 1.5 * random.random((height, width, 3)) ** 3
    for _ in range(6):
        x, y = random.integers(width), random.integers(height)
        picture[y : y + 3, x : x + 2] = 20 * random.random(3)
    if name in ("negative", "tall", "small"):
        picture -= 0.8 * random.random(picture.shape) * (random.random((height, width, 1)) < 0.3)
        picture[3:5, 4:8] = -0.7
        picture[10:12, 5:9] = 6, -4, 1
        picture[10:12, 9:12] = -5, 6, 2
    return picture.astype(np.float32)


def kernel(width: int, height: int) -> np.ndarray:
    """Return an image for the type "kernel"."""
    return np.random.default_rng(width * height).random((height, width, 3)).astype(np.float32)


def of_blender(count: int = 252, seed: int = 1) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield names of images and fields of `vkbloom.BlenderGlare`, all types and qualities in turn.

    A field is at its default or one of a few values, among them the ends of its range.
    """
    random = np.random.default_rng(seed)
    names = [*SIZES]

    def sometimes(share: float, **values: Any) -> dict[str, Any]:
        return {
            name: random.choice(choices, axis=0).tolist()
            for name, choices in values.items()
            if random.random() < share
        }

    for number in range(count):
        type = TYPES[number % 7]
        fields = {"type": type, "quality": QUALITIES[number // 7 % 3]}
        fields |= sometimes(0.6, threshold=[0, 0.3, 1, 2.5], smoothness=[0, 0.1, 0.5, 1])
        fields |= sometimes(0.3, maximum=[0, 0.5, 4, 10])
        fields |= sometimes(0.5, intensity=[0.1, 0.5, 1], saturation=[0, 0.3, 0.8, 1, 2])
        fields |= sometimes(0.5, tint=[(1, 0.7, 0.2), (0, 1, 0.5), (0.2, 0.2, 1)])
        if type in ("bloom", "fog_glow", "sun_beams"):
            fields |= sometimes(0.8, size=[0, 0.01, 0.1, 0.3, 0.7, 1])
        if type == "streaks":
            fields |= sometimes(0.7, streaks=[1, 2, 3, 7, 16], streaks_angle=[-137, 0, 23, 90, 180])
        if type in ("streaks", "ghosts", "simple_star"):
            fields |= sometimes(0.9, iterations=[2, 3, 4, 5])
            fields |= sometimes(0.7, fade=[0.75, 0.85, 0.95, 1], color_modulation=[0, 0.25, 0.6, 1])
        if type == "simple_star":
            fields |= sometimes(0.8, diagonal=[True, False])
        if type == "sun_beams":
            fields |= sometimes(0.8, sun_position=[(-0.3, 0.5), (0.123, 0.77), (1, 0), (0.4, 1.4)])
            fields |= sometimes(0.5, jitter=[0.1, 0.3, 0.5, 0.9, 1])
        if type == "kernel":
            fields["kernel"] = random.choice([(5, 3), (6, 4), (21, 30)], axis=0).tolist()
        # The last 42 are for the image whose frames are kept: each type and quality twice.
        yield names[-1] if number >= count - 42 else names[random.integers(6)], fields


def of_blender_5_2() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the same for Blender 5.2, without kernels of which low quality leaves no pixel.

    With those, Blender reads memory that it has not written.
    """
    for name, fields in of_blender():
        if fields["quality"] == "low" and fields.get("kernel") == [5, 3]:
            fields["kernel"] = [5, 4]
        yield name, fields | {"version": "5.2"}


def is_kept(engine: str, picture: str, fields: dict[str, Any]) -> bool:
    """Return whether the frames of a case are kept for the tests.

    Of Blender 5.2, they are those that differ from 5.0.
    """
    if engine == "blender-5.2" and fields["type"] not in ("streaks", "kernel"):
        return picture == "negative" and fields["type"] == "bloom"
    return picture == "small"


def of_pygfx(count: int = 108, seed: int = 2) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield names of images and fields of `vkbloom.PygfxBloom`.

    "rgba32float" is the pass alone on single floats, "rgba8unorm-srgb" the stock renderer.
    """
    random = np.random.default_rng(seed)
    names = [*SIZES]
    for number in range(count):
        fields: dict[str, Any] = {"format": ("rgba32float", "rgba8unorm-srgb")[number % 2]}
        for name, values in {
            "levels": [1, 2, 4, 6, 12],
            "filter_radius": [0, 0.001, 0.02, 0.1],
            "karis_average": [True, False],
            "intensity": [0.01, 0.2, 0.5, 1],
        }.items():
            if random.random() < 0.7:
                fields[name] = random.choice(values).item()
        yield names[-1] if number >= count - 8 else names[random.integers(6)], fields
