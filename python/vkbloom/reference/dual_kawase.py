"""The dual Kawase blur: five taps down, eight taps up.

From Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015.
"""

from __future__ import annotations

from typing import Protocol

from .image import Storage
from .levels import level_sizes
from .sampling import CENTRE, Array, Taps, sample

__all__ = ["gain", "passes"]


class DualKawaseSettings(Protocol):
    """What this blur reads of `vkbloom.DualKawase`."""

    @property
    def levels(self) -> int: ...
    @property
    def offset(self) -> float: ...


def passes(
    glow: Array,
    settings: DualKawaseSettings,
    size: tuple[int, int],
    store: Storage,
) -> dict[str, Array]:
    """Return the framebuffers on the way down and up; nothing is added on the way up.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
    settings : vkbloom.DualKawase
    size : (int, int)
        Width and height of the bloom, in pixels.
    store : callable
        What storing in a bloom buffer does to the values.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    sizes = level_sizes((width, height), settings.levels)
    framebuffers: dict[str, Array] = {}
    image = glow
    for k, level_size in enumerate(sizes):
        image = store(_down(image, level_size, settings.offset))
        framebuffers[f"down_{k}"] = image
    for k in range(len(sizes) - 2, -1, -1):
        image = store(_up(image, sizes[k], settings.offset))
        framebuffers[f"up_{k}"] = image
    framebuffers["bloom"] = store(_up(image, size, settings.offset))
    return framebuffers


def gain(settings: DualKawaseSettings) -> float:
    """Return what a flat image of 1 becomes: 1, as the weights of both filters sum to 1."""
    return 1.0


def _down(image: Array, size: tuple[int, int], offset: float) -> Array:
    """(4 centre + 4 diagonals at offset * half a texel) / 8, texels of `image`."""
    diagonals = _pair(offset / 2)
    return (4 * sample(image, size) + sample(image, size, diagonals, diagonals)) / 8


def _up(image: Array, size: tuple[int, int], offset: float) -> Array:
    """(4 axials at offset * one texel + 2 * 4 diagonals at half of that) / 12."""
    axial, diagonals = _pair(offset), _pair(offset / 2)
    axials = sample(image, size, axial, CENTRE) + sample(image, size, CENTRE, axial)
    return (axials + 2 * sample(image, size, diagonals, diagonals)) / 12


def _pair(distance: float) -> Taps:
    """Two taps of weight 1 on both sides of the centre."""
    return ((-distance, 1.0), (distance, 1.0))
