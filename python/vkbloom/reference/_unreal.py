"""Unreal Engine's standard bloom: the convolution with a sum of Gaussians."""

from __future__ import annotations

import dataclasses
from typing import Any

from . import _convolution as convolution
from ._convolution import gain
from ._image import BlurInput
from ._sampling import Array
from ._threshold import masked

__all__ = ["gain", "passes"]


def passes(source: BlurInput, settings: Any) -> dict[str, Array]:
    """Return "kernel" and "bloom"."""
    image = masked(source.image, source.mask)
    return convolution.passes(dataclasses.replace(source, image=image), settings)
