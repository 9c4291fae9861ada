"""Facts of OpenEXR files."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

from vkbloom._io.formats.facts import Facts
from vkbloom._io.picture import Alpha

if TYPE_CHECKING:
    import OpenImageIO


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return whether colours are straight; alpha of a layer has another name than A."""
    is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha")
    return Facts(alpha=Alpha.STRAIGHT if is_straight else Alpha.MULTIPLIED)
