"""Halation and scattering of film, as agx-emulsion has them.

From andreavolpato/agx-emulsion @ 0e0baf2e3dd5, apply_halation_um.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._sampling import Array, sample
from ._threshold import masked

if TYPE_CHECKING:
    from vkbloom._methods.halation import Halation

__all__ = ["gain", "passes"]


# Micrometres along the longer side of a frame of film, if no size of a pixel is given.
_FILM = 35000.0


def passes(source: BlurInput, settings: Halation) -> dict[str, Array]:
    """Return the framebuffers.

    With a strength h and a Gaussian G of each channel, an image a becomes (a + h G(a)) / (1 + h):
    "halation" from the frame, and the bloom from that, by the scattering. Beyond the borders is the
    mirrored image, whose outermost pixels are there twice.
    """
    height, width, _ = source.image.shape
    pixel = settings.pixel_size or _FILM / max(width, height)
    image = masked(source.image, source.mask)
    halation = source.store(_spread(image, settings.strength, settings.sizes, pixel))
    scattered = _spread(halation, settings.scattering_strength, settings.scattering_sizes, pixel)
    return {"halation": halation, "bloom": source.store.end(sample(scattered, source.size))}


def gain(settings: Halation, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1."""
    return 1.0


def _spread(image: Array, strengths: Sequence[float], sizes: Sequence[float], pixel: float) -> Array:
    """Mix each channel with its blur; sizes in micrometres. Alpha is not blurred."""
    channels = []
    for c in range(image.shape[2]):
        channel = image[..., c : c + 1]
        if c < 3 and strengths[c] > 0:
            height, width, _ = channel.shape
            rows = channel.reshape(height, width) @ _gaussian(width, sizes[c] / pixel).T
            both = (rows.swapaxes(0, 1) @ _gaussian(height, sizes[c] / pixel).T).swapaxes(0, 1)
            channel = (channel + strengths[c] * both.reshape(height, width, 1)) / (1 + strengths[c])
        channels.append(channel)
    return np.concatenate(channels, axis=-1)


def _gaussian(length: int, deviation: float) -> Array:
    """Return the blur of a mirrored line as a matrix."""
    radius = int(7 * deviation + 0.5)
    offsets = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (offsets / deviation) ** 2) if radius else np.ones(1)
    weights /= weights.sum()
    places = (np.arange(length)[:, np.newaxis] + offsets) % (2 * length)
    matrix = np.zeros((length, length))
    lines = np.broadcast_to(np.arange(length)[:, np.newaxis], places.shape)
    np.add.at(matrix, (lines, np.minimum(places, 2 * length - 1 - places)), weights)
    return matrix
