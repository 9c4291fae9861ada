"""Facts of DPX and Cineon files."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

from vkbloom._io.formats.facts import Facts

if TYPE_CHECKING:
    import OpenImageIO


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Raise ValueError for lines along the columns; the rest OpenImageIO knows.

    It exchanges width and height before it reads such lines.
    """
    if spec.getattribute("Orientation") in (5, 6, 7, 8):
        raise ValueError(f"{stream.name}: lines along the columns are not supported")
    return Facts()
