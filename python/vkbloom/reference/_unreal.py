"""Unreal Engine's standard bloom: the convolution with a sum of Gaussians."""

from __future__ import annotations

import dataclasses
from typing import Any

from . import _convolution as convolution
from ._image import BlurInput
from ._sampling import Array
from ._threshold import masked

__all__ = ["gain", "passes"]


def gain(settings: Any, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the sum of the tints."""
    return float(sum(settings.tints))


def passes(source: BlurInput, settings: Any) -> dict[str, Array]:
    """Return "kernel" and "bloom"."""
    image = masked(source.image, source.mask)
    return convolution.passes(dataclasses.replace(source, image=image), settings)
