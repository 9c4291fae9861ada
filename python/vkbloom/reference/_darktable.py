"""Bloom of darktable.

From darktable 4.2.1, src/iop/bloom.c, with its conversion to CIE Lab.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._blending import develop
from ._image import BlurInput
from ._sampling import Array, sample
from ._tape import contiguous, operation, value_of
from ._threshold import apply_mask

if TYPE_CHECKING:
    from vkbloom._methods.darktable import DarktableBloom

# XYZ of linear Rec. 709, with a white of D50, over the white.
_XYZ = np.array(
    [
        (0.4360747, 0.3850649, 0.1430804),
        (0.2225045, 0.7168786, 0.0606169),
        (0.0139322, 0.0971045, 0.7141733),
    ]
)
_SHARES = _XYZ / _XYZ.sum(axis=1, keepdims=True)
_SLOPE = 24389 / 27


def passes(source: BlurInput, settings: DarktableBloom) -> dict[str, Array]:
    """Return "bright", the lightness above the threshold, and "bloom", its means of boxes."""
    rgb, alpha = source.image[..., :3], source.image[..., 3:]
    light = _bright(rgb, settings)
    kept = np.concatenate([light, light, light, alpha * (value_of(light) != 0)], axis=-1)
    bright = source.store(apply_mask(kept, source.mask))
    image = bright
    for _ in range(8):
        for _ in range(2):
            image = contiguous(_mean(image, settings.box_radius).swapaxes(0, 1))
        image = contiguous(image)
    return {"bright": bright, "bloom": source.store.end(sample(image, source.size))}


def gain(settings: DarktableBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: what the strength makes of it."""
    return float(_bright(np.ones((1, 1, 3)), settings)[0, 0, 0])


def composite(scene: Array, light: Array, settings: DarktableBloom, share: float | Array) -> Array:
    """Return the scene with the screen of its lightness and of light, and its a and b."""
    f = _lab(scene)
    f = f + light[..., :1] * (1 - f[..., 1:2])
    shares = np.where(f > 6 / 29, f**3, (116 * f - 16) / _SLOPE)
    return develop(shares @ np.linalg.inv(_SHARES).T, settings)


def _lab(colour: Array) -> Array:
    shares = colour @ _SHARES.T
    root = np.maximum(shares, 1e-30) ** (1 / 3)
    f: Array = np.where(shares > 216 / 24389, root, (_SLOPE * shares + 16) / 116)
    return f


def _bright(rgb: Array, settings: DarktableBloom) -> Array:
    """Return the lightness over 100, with the strength, above the threshold, (H, W, 1)."""
    factor = 2 ** (np.minimum(100, settings.strength + 1) / 100)
    light = factor * (116 * _lab(rgb)[..., 1:2] - 16)
    if settings.threshold is not None:
        light = np.where(light > settings.threshold, light, 0.0)
    bright: Array = light / 100
    return bright


def _mean(image: Array, radius: int) -> Array:
    """Return the means along the first axis of the pixels up to a radius away that exist."""
    length = image.shape[0]
    ends = np.arange(length)[:, np.newaxis] + (-radius, radius + 1)
    first, end = np.clip(ends, 0, length).T
    counts = (end - first).reshape(-1, 1, 1)

    def back(derivative: Array) -> Array:
        changes = np.zeros((length + 1, *derivative.shape[1:]))
        np.add.at(changes, first, derivative / counts)
        np.add.at(changes, end, -derivative / counts)
        return np.cumsum(changes[:-1], axis=0)

    values = value_of(image)
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    means: Array = operation((sums[end] - sums[first]) / counts, (image, back))
    return means
