"""Unreal Engine's standard bloom: the convolution with a sum of Gaussians."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from . import _convolution as convolution
from ._image import BlurInput
from ._sampling import Array
from ._threshold import apply_mask, luminance


def gain(settings: Any, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the sum of the tints, times the threshold's share."""
    share = float(_prefilter(np.ones((1, 1, 3)), settings)[0, 0, 0])
    return share * float(sum(settings.tints))


def passes(source: BlurInput, settings: Any) -> dict[str, Array]:
    """Return "bloom"."""
    return {"bloom": spread(source, settings)["bloom"]}


def spread(source: BlurInput, settings: Any) -> dict[str, Array]:
    """Return "kernel" and "bloom"."""
    if source.mask is None and settings.threshold in (None, -1):
        return convolution.passes(source, settings)
    image = apply_mask(_prefilter(source.image, settings), source.mask)
    return convolution.passes(dataclasses.replace(source, image=source.store(image)), settings)


def _prefilter(rgb: Array, settings: Any) -> Array:
    if settings.threshold is None or settings.threshold == -1:
        return rgb
    kept: Array = rgb * np.clip(luminance(rgb) - settings.threshold, 0, 1)
    return kept
