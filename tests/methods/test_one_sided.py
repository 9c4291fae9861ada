"""Derivatives at random points, among them kinks, beside differences to both sides.

Where the differences to the left and to the right agree, they are the derivative. Elsewhere the
derivative is any that the documentation names.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import EXHAUSTIVE, some
from tests.methods.test_adjoint_passes import CASES as METHODS
from tests.methods.test_derivatives import BOUNDARIES, CURVED, KERNEL
from vkbloom import BlenderGlare, GodotBloom, Pyramid, Renderer, Separable, reference

Array = NDArray[np.float64]

GLARES = (
    vkbloom.Streaks(threshold=0.25, iterations=2),
    vkbloom.Ghosts(threshold=0.25),
    vkbloom.Halo(),
    vkbloom.Dirt(seed=1),
)
TONE_MAPS: tuple[Any, ...] = ("none", "reinhard", "aces", "exponential", "khronos_neutral", "agx")
ENCODINGS: tuple[Any, ...] = ("none", "gamma22", "srgb", "pq", "hlg")
COMPOSITES: tuple[Any, ...] = ("add", "mix", "screen")
BLENDER_TYPES: tuple[Any, ...] = (
    *("bloom", "fog_glow", "streaks", "ghosts", "simple_star", "sun_beams"),
)
#: Heights of levels that do not follow from the image's.
_LOW: Final = {"bevy_natural": "max_mip_dimension", "photo": "max_mip_dimension"}
SETTINGS: tuple[Any, ...] = (
    *METHODS.values(),
    *(each.replace(format=None) for each in CURVED.values()),
    *(
        Separable(tonemap=tonemap, encoding=encoding, composite=composite, threshold=0.25, knee=1.0)
        for tonemap, encoding, composite in zip(
            TONE_MAPS * 5, [e for e in ENCODINGS for _ in TONE_MAPS], COMPOSITES * 10, strict=True
        )
    ),
    *(
        GodotBloom(composite=composite, tonemap=tonemap, threshold=0.5, threshold_scale=0.5)
        for composite, tonemap in itertools.product(
            ("add", "mix", "screen", "soft_light", "replace"), ("none", "reinhard", "agx")
        )
    ),
    *(
        BlenderGlare(type=type, saturation=saturation, threshold=threshold, quality="high")
        for type, saturation, threshold in itertools.product(
            BLENDER_TYPES, (0.25, 1.0, 1.5), (None, 0.5)
        )
    ),
    *(
        Pyramid(levels=2, alpha=alpha, composite=composite, threshold=0.5, glare=glare)
        for alpha, composite, glare in zip(
            ("keep", "max", "blur") * 4, COMPOSITES * 4, [(one,) for one in GLARES] * 3, strict=True
        )
    ),
    *(vkbloom.Convolution(psf=KERNEL, boundary=each, threshold=0.5, knee=0.5) for each in BOUNDARIES),
)
#: 10,000 directions when exhaustive.
POINTS: Final = 1250
DIRECTIONS: Final = 8
#: Where curves and thresholds have kinks.
LEVELS: Final = (0.0, 1.0, 0.25, 0.5, 0.75, 0.0031308, 1 / 12 / 0.26496, 1 / 0.26496, 0.08, 0.8)


def points(first: int = 0) -> Iterator[int]:
    return iter(some(range(POINTS), 24))


def point(random: np.random.Generator, channels: int) -> Array:
    """Return a small image of float32 with colours, greys, black, white and kinks."""
    height, width = (int(random.integers(1, 8)) for _ in range(2))
    image = random.random((height, width, channels)) * 1.5
    grey = random.random((height, width, 1)) * 1.5
    level = random.choice(LEVELS, (height, width, 1))
    primary = level * (random.random((height, width, channels)) < 0.5)
    kind = random.choice(6, (height, width, 1), p=random.dirichlet(np.ones(6)))
    colours = (image, np.broadcast_to(grey, image.shape), level + 0 * image, primary, -image, 0 * image)
    chosen = np.choose(kind, [np.asarray(one) for one in colours])
    if channels == 4:
        chosen[..., 3] = random.choice([0.0, 0.5, 1.0], (height, width))
    return chosen.astype(np.float32).astype(np.float64)


def moved(random: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Return a direction: of all pixels or of one, of all channels, of one, grey or of two."""
    direction = random.standard_normal(shape)
    kind = random.integers(5)
    if kind == 1:
        direction[:] = direction[..., :1]
    if kind == 2:
        direction[..., 0] = -direction[..., 1]
        direction[..., 2:] = 0
    if kind == 3:
        direction[..., np.arange(shape[2]) != random.integers(shape[2])] = 0
    if kind == 4:
        direction[..., 0] = -direction[..., 1:3].sum(axis=-1)
    if random.random() < 0.5:
        kept = np.zeros(shape)
        kept[random.integers(shape[0]), random.integers(shape[1])] = 1
        direction *= kept
    return direction
