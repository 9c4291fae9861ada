"""Facts of FITS files (FITS 4.0): the scale of their numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import MAX_FLOAT
from vkbloom._io.formats.facts import Corrected, Facts
from vkbloom._io.picture import NUMBERS_ADVICE

if TYPE_CHECKING:
    import OpenImageIO

#: Signed numbers by OpenImageIO's names, which the files scale.
SIGNED: Final[Mapping[str, np.dtype[Any]]] = {
    "int16": np.dtype(np.int16),
    "int": np.dtype(np.int32),
}
# A file consists of blocks of lines, and its images begin with one of these (4.4.1).
_BLOCK, _CARD = 2880, 80
_IMAGES: Final = (b"SIMPLE", b"XTENSION= 'IMAGE   '")
# OpenImageIO does not know Fortran's exponents.
_SCALE: Final = re.compile(
    rb"(BSCALE  |BZERO   )= *([-+]?(?:\d+\.?\d*|\.\d+)(?:[ED][-+]?\d+)?) *(?:/|\Z)", re.IGNORECASE
)
# What stands for unsigned numbers of 16 bits, which the format does not have (table 11).
_UNSIGNED: Final = (1, 32768)


def find_facts(stream: BinaryIO, spec: OpenImageIO.ImageSpec, part: int) -> Facts:
    """Return how the numbers of a part are scaled."""
    # (As the floats that OpenImageIO keeps.)
    factor, offset = (float(np.float32(value)) for value in scale_of(stream, part))
    kind = str(spec.format)
    if (factor, offset) == (1, 0):
        if kind in SIGNED:
            raise ValueError(f"{stream.name}: {NUMBERS_ADVICE.format(kind)}")
        return Facts()
    is_unsigned = (factor, offset) == _UNSIGNED and kind == "int16"

    def scale(pixels: NDArray[Any]) -> Corrected:
        """Return the physical values (4.4.2.5): BZERO + BSCALE x stored."""
        if is_unsigned:
            return Corrected(pixels.view(np.uint16) ^ np.uint16(32768))
        with np.errstate(over="ignore", invalid="ignore"):
            made = (pixels * np.float64(factor) + offset).astype(np.float32)
        said = f"its values are BSCALE {factor:.6g} times the stored ones plus BZERO {offset:.6g}"
        return Corrected(made, (said,))

    return Facts(numbers="uint16" if is_unsigned else "float", correct=scale)


def scale_of(stream: BinaryIO, part: int) -> tuple[float, float]:
    """Return BSCALE and BZERO of a part, 1 and 0 if it has none."""
    found: dict[bytes, float] = {}
    index = -1
    while len(block := stream.read(_BLOCK)) == _BLOCK:
        index += block.startswith(_IMAGES)
        if index != part:
            continue
        cards = [block[at : at + _CARD] for at in range(0, _BLOCK, _CARD)]
        for match in filter(None, map(_SCALE.match, cards)):
            value = float(match[2].upper().replace(b"D", b"E"))
            if abs(value) <= MAX_FLOAT:
                found.setdefault(match[1].upper().strip(), value)
        if any(card.startswith(b"END ") for card in cards):
            break
    return found.get(b"BSCALE", 1.0), found.get(b"BZERO", 0.0)
