"""Halation and scattering of film: the convolution with Gaussians, with mirrored borders.

From andreavolpato/agx-emulsion @ 0e0baf2e3dd5, apply_halation_um.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from . import _convolution as convolution
from ._image import BlurInput
from ._sampling import Array
from ._threshold import masked

__all__ = ["gain", "passes"]


def gain(settings: Any, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, since light is only moved."""
    return 1.0


def passes(source: BlurInput, settings: Any) -> dict[str, Array]:
    """Return "kernel" and "bloom"."""
    if source.mask is None:
        return convolution.passes(source, settings)
    image = source.store(masked(source.image, source.mask))
    return convolution.passes(dataclasses.replace(source, image=image), settings)
