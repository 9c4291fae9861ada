"""The sRGB curve for expected values: the formulas of IEC 61966-2-1, apart from the package's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def decode_srgb(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Return linear values in doubles; the curve continues above 1."""
    values = np.asarray(encoded, np.float64)
    return np.where(
        values <= 0.04045, values / 12.92, ((np.maximum(values, 0.0) + 0.055) / 1.055) ** 2.4
    )


def encode_srgb(linear: NDArray[Any]) -> NDArray[np.float64]:
    """Return encoded values in doubles; the curve continues above 1."""
    values = np.asarray(linear, np.float64)
    return np.where(
        values <= 0.0031308, values * 12.92, 1.055 * np.maximum(values, 0.0) ** (1 / 2.4) - 0.055
    )
