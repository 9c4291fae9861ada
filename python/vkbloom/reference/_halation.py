"""Halation and scattering of film: the convolution with Gaussians, with mirrored borders.

From andreavolpato/agx-emulsion @ 0e0baf2e3dd5, apply_halation_um.
"""

from __future__ import annotations

from typing import Any

from . import _unreal

# The convolution of Unreal's bloom, with other kernels.
passes = _unreal.spread


def gain(settings: Any, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, since light is only moved."""
    return 1.0
