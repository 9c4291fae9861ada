"""The values that image files of integers hold, and how exactly they hold others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.srgb import decode_srgb, encode_srgb

# Files of this many bits or less hold no small part of a value.
_COARSE: Final = 8
# Levels by which lossy files change a flat image.
_LOSSY: Final = 3
# Accuracy of the arithmetic on both sides of the files.
_FLOAT: Final = 1e-6


@dataclass(frozen=True, kw_only=True)
class Levels:
    """The values of a program's image files: integers that encode 0 to 1 by the curve of sRGB.

    - `bits`: of the integers.
    - `is_lossy`: Whether the format changes more than the last bit, as JPEG does. Then only images
      of one colour are exact.
    - `is_difference`: Whether the bloom is a picture less its input. Its values are then as exact
      as those of the picture.
    """

    bits: int = _COARSE
    is_lossy: bool = False
    is_difference: bool = False

    @property
    def is_coarse(self) -> bool:
        """Whether a level is a visible part of common values."""
        return self.bits <= _COARSE

    @property
    def reason(self) -> str:
        """What the files hold, in words."""
        return "lossy files" if self.is_lossy else f"{self.bits} bits"

    def quantize(self, image: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the nearest values that a file holds."""
        most = 2**self.bits - 1
        encoded = encode_srgb(np.clip(image, 0, 1).astype(np.float64))
        return np.asarray(decode_srgb(np.rint(encoded * most) / most))

    def error(self, values: NDArray[np.float64], given: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the error of values of a bloom of `given`: a level, as a program may truncate.

        Of lossy files, which convert colours as well, more.
        """
        shown = np.clip(values + given if self.is_difference else values, 0, 1)
        encoded = encode_srgb(shown)
        step = (_LOSSY if self.is_lossy else 1) / (2**self.bits - 1)
        return np.asarray(decode_srgb(encoded + step) - shown + _FLOAT)
