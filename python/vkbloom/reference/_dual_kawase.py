"""The dual Kawase blur: five taps down, eight taps up.

From Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from ._image import BlurInput
from ._sampling import CENTRE, Array, box, level_sizes, sample, size_of
from ._upsampling import combine, halvings

if TYPE_CHECKING:
    from vkbloom._methods.mip_chain import DualKawase


def passes(source: BlurInput, settings: DualKawase) -> dict[str, Array]:
    """Return the framebuffers on the way down and up; nothing is added on the way up."""
    count = len(level_sizes(size_of(source.image), settings.levels))
    shrink, enlarge = (partial(filter, offset=settings.offset) for filter in (down, up))
    downs = halvings(source.image, 1 + count, source.store, shrink)[1:]
    shares = [0.0] * count, [1.0] * count
    return combine(downs, source, shares, upsample=enlarge, last=enlarge, end=source.store)


def gain(settings: DualKawase, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, since the weights of both filters sum to 1."""
    return 1.0


def down(image: Array, size: tuple[int, int], offset: float) -> Array:
    """Return (4 centre + 4 diagonals at offset / 2 texels of `image`) / 8."""
    return (sample(image, size) + box(image, size, offset / 2)) / 2


def up(image: Array, size: tuple[int, int], offset: float) -> Array:
    """Return (4 taps on the axes at offset texels + 2 * 4 diagonals at half of that) / 12."""
    axial = ((-offset, 1.0), (offset, 1.0))
    axials = sample(image, size, axial, CENTRE) + sample(image, size, CENTRE, axial)
    return (axials + 8 * box(image, size, offset / 2)) / 12
