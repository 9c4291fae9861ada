"""What is known of framebuffers without their renderer: which leads, and the axes' names."""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

__all__ = ["Framebuffers", "MadeWith", "dimensions", "leading"]


class MadeWith(Protocol):
    """The part of a `Settings` that those who show and write framebuffers read."""

    @property
    def encoding(self) -> str:
        """The transfer curve that `final` has passed, or "none"."""

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name, and ``method``."""


class Framebuffers(Protocol):
    """Framebuffers with how they came about, as those that show and write them see a `Frames`."""

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds on the device by pass name."""

    @property
    def settings(self) -> MadeWith:
        """The settings that the framebuffers were made with."""

    @property
    def info(self) -> Mapping[str, Any]:
        """Adapter, driver and version among others."""

    def __getitem__(self, name: str, /) -> NDArray[Any]: ...

    def __iter__(self) -> Iterator[str]: ...

    def __len__(self) -> int: ...

    def items(self) -> ItemsView[str, NDArray[Any]]:
        """Return the framebuffers with their names, in the order that the data flows."""


def leading(arrays: Mapping[str, NDArray[Any]] | Framebuffers) -> str:
    """Name the framebuffer that stands for all: `final`, the last image, or the last.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Images of shape (H, W, C) and depth of shape (H, W), one at least.

    Returns
    -------
    str
        "final", or else the last name of an image, or else the last name.
    """
    if "final" in arrays:
        return "final"
    images = [name for name, array in arrays.items() if array.ndim == 3]
    return (images or list(arrays))[-1]


def dimensions(arrays: Mapping[str, NDArray[Any]]) -> dict[str, tuple[str, ...]]:
    """Name the axes of framebuffers, so that those of one size share their dimensions.

    Framebuffers of the size of `final` (or, without it, of the last image) have the
    dimensions "y" and "x"; others "<first>_y" and "<first>_x", where <first> is the first
    framebuffer of that size. Likewise "channel" belongs to `final`'s number of channels
    and "<first>_channel" to any other. So `glow - blur_vertical` is an image, and not an
    array of six dimensions.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Images of shape (H, W, C) and depth of shape (H, W), one at least.

    Returns
    -------
    dict of str to tuple of str
        The names of the axes by framebuffer, three for images, two for depth.
    """
    shape = arrays[leading(arrays)].shape
    # Keys are (H, W) and (C,), which cannot meet.
    prefixes = {shape[:2]: "", shape[2:]: ""}
    named: dict[str, tuple[str, ...]] = {}
    for name, array in arrays.items():
        plane = prefixes.setdefault(array.shape[:2], f"{name}_")
        named[name] = (f"{plane}y", f"{plane}x")
        if array.ndim == 3:
            named[name] += (prefixes.setdefault(array.shape[2:], f"{name}_") + "channel",)
    return named
