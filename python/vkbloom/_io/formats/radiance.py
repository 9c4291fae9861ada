"""Facts of Radiance HDR files: primaries and orientation."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, BinaryIO, Final

from vkbloom._io.chromaticities import other_primaries
from vkbloom._io.formats.facts import Facts
from vkbloom._io.picture import StatedColours

if TYPE_CHECKING:
    import OpenImageIO

_MAX_HEADER: Final = 1 << 16
# Lines of the header, which end with an empty one.
_LINE: Final = re.compile(rb"^(PRIMARIES|EXPOSURE|COLORCORR)=([^\n]*)$", re.MULTILINE)
_RESOLUTION: Final = re.compile(rb"\n\n([-+][XY])\s*\d+\s*([-+][XY])\s*\d+\s*\n")
# Exif's orientation by the resolution line: the axis of the scanlines comes first, and "-Y" runs
# downwards. OpenImageIO 3.2 exchanges 6 and 8.
_ORIENTATIONS: Final = (b"-Y+X", b"-Y-X", b"+Y-X", b"+Y+X", b"+X-Y", b"-X-Y", b"-X+Y", b"+X+Y")


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return what the lines of the header say."""
    header = stream.read(_MAX_HEADER)
    match = _RESOLUTION.search(header)
    axes = b"" if match is None else match[1] + match[2]
    stated = StatedColours(
        space=spec.get_string_attribute("oiio:ColorSpace"),
        gamma=spec.get_float_attribute("oiio:Gamma", 0.0) or None,
    )
    return Facts(
        orientation=_ORIENTATIONS.index(axes) + 1 if axes in _ORIENTATIONS else None,
        colours=_find_colours(header, stated),
    )


def _find_colours(header: bytes, stated: StatedColours) -> StatedColours:
    said = []
    for name, words in _LINE.findall(header.replace(b"\r\n", b"\n").partition(b"\n\n")[0]):
        try:
            values = [float(word) for word in words.split()]
        except ValueError:
            continue
        if name == b"PRIMARIES":
            stated = stated._replace(primaries=other_primaries(values))
        elif any(value != 1 for value in values):
            said.append(f"{name.decode()}={' '.join(f'{value:.4g}' for value in values)}")
    return stated._replace(said=tuple(said))
