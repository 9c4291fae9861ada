"""Framebuffers by name and shape: the requested ones, the leading one, the names of dimensions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray


def leading(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return the name of the framebuffer that represents all of them."""
    if "final" in arrays:
        return "final"
    images = [name for name, array in arrays.items() if array.ndim == 3]
    return (images or list(arrays))[-1]


def dimensions(arrays: Mapping[str, NDArray[Any]]) -> dict[str, tuple[str, ...]]:
    """Name the dimensions of framebuffers, so that framebuffers of one size share them.

    Framebuffers of the size of `final` (or, without it, of the last image) have the
    dimensions "y" and "x"; others "<first>_y" and "<first>_x", where <first> is the first
    framebuffer of that size. Likewise "channel" is the dimension of `final`'s number of
    channels and "<first>_channel" of another number. With shared dimensions, xarray computes
    `glow - blur_vertical` pixel by pixel; otherwise it would broadcast to six dimensions.
    """
    shape = arrays[leading(arrays)].shape
    # Keys are (H, W) and (C,), which differ in length and cannot collide.
    prefixes = {shape[:2]: "", shape[2:]: ""}
    named: dict[str, tuple[str, ...]] = {}
    for name, array in arrays.items():
        plane = prefixes.setdefault(array.shape[:2], f"{name}_")
        named[name] = (f"{plane}y", f"{plane}x")
        if array.ndim == 3:
            named[name] += (prefixes.setdefault(array.shape[2:], f"{name}_") + "channel",)
    return named


def check_framebuffers(framebuffers: str | Sequence[str]) -> tuple[str, ...] | None:
    """Return the names of the requested framebuffers; None for all."""
    if isinstance(framebuffers, str):
        return None if framebuffers == "all" else (framebuffers,)
    return tuple(framebuffers)
