"""The dual Kawase blur: five taps down, eight taps up.

From Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._image import BlurInput
from ._levels import level_sizes
from ._sampling import CENTRE, Array, Taps, sample

if TYPE_CHECKING:
    from vkbloom._methods.mip_chain import DualKawase


def passes(source: BlurInput, settings: DualKawase) -> dict[str, Array]:
    """Return the framebuffers on the way down and up; nothing is added on the way up."""
    height, width, _ = source.image.shape
    sizes = level_sizes((width, height), settings.levels)
    framebuffers: dict[str, Array] = {}
    image = source.image
    for k, level_size in enumerate(sizes):
        image = source.store(down(image, level_size, settings.offset))
        framebuffers[f"down_{k}"] = image
    for k in range(len(sizes) - 2, -1, -1):
        image = source.store(up(image, sizes[k], settings.offset))
        framebuffers[f"up_{k}"] = image
    framebuffers["bloom"] = source.store(up(image, source.size, settings.offset))
    return framebuffers


def gain(settings: DualKawase, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, since the weights of both filters sum to 1."""
    return 1.0


def down(image: Array, size: tuple[int, int], offset: float) -> Array:
    """Return (4 centre + 4 diagonals at offset / 2 texels of `image`) / 8."""
    diagonals = _pair(offset / 2)
    return (4 * sample(image, size) + sample(image, size, diagonals, diagonals)) / 8


def up(image: Array, size: tuple[int, int], offset: float) -> Array:
    """Return (4 taps on the axes at offset texels + 2 * 4 diagonals at half of that) / 12."""
    axial, diagonals = _pair(offset), _pair(offset / 2)
    axials = sample(image, size, axial, CENTRE) + sample(image, size, CENTRE, axial)
    return (axials + 2 * sample(image, size, diagonals, diagonals)) / 12


def _pair(distance: float) -> Taps:
    """Return two taps of weight 1, one on each side of the centre."""
    return ((-distance, 1.0), (distance, 1.0))
