"""The sRGB transfer curve and its inverse (IEC 61966-2-1), for arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def decode_srgb(encoded: NDArray[Any]) -> NDArray[Any]:
    """Decode sRGB values to linear values.

    - `encoded`: Any shape. The curve is defined for 0..1 and continued above.
    - Returns: the same shape and dtype: x / 12.92 up to 0.04045, then ((x + 0.055) / 1.055)^2.4
      (IEC 61966-2-1).
    """
    kind = encoded.dtype.type
    # The maximum avoids powers of negative numbers, where the linear part is used.
    curve = ((np.maximum(encoded, kind(0.04045)) + kind(0.055)) / kind(1.055)) ** kind(2.4)
    linear: NDArray[Any] = np.where(encoded <= kind(0.04045), encoded / kind(12.92), curve)
    return linear


def encode_srgb(linear: NDArray[Any]) -> NDArray[Any]:
    """Encode linear values to sRGB, the inverse of `decode_srgb`.

    - `linear`: Any shape. The curve is defined for 0..1 and continued above.
    - Returns: the same shape and dtype: 12.92 x up to 0.0031308, then 1.055 x^(1 / 2.4) - 0.055
      (IEC 61966-2-1).
    """
    kind = linear.dtype.type
    curve = kind(1.055) * np.maximum(linear, kind(0.0031308)) ** kind(1 / 2.4) - kind(0.055)
    encoded: NDArray[Any] = np.where(linear <= kind(0.0031308), linear * kind(12.92), curve)
    return encoded
