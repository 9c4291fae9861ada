"""The mask of a meter: how much each part of the frame counts."""

from __future__ import annotations

from typing import Any

import numpy as np

from vkbloom._psf.sampled import check_values


def read_mask(values: Any) -> Any:
    """Return the mask as an `ArrayValue` of 0 to 1, (h, w); raise TypeError or ValueError."""
    if getattr(values, "dtype", None) == np.uint8:
        values = np.asarray(values, np.float32) / np.float32(255)
    held = check_values("mask", values)
    if held.array.ndim != 2:
        raise ValueError(f"mask: shape {held.array.shape} is not (h, w)")
    if held.array.min() < 0 or held.array.max() > 1:
        raise ValueError("mask: some values are out of range, 0 to 1")
    return held
