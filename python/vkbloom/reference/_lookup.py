"""The modules of the methods, by the methods' names."""

from __future__ import annotations

from typing import Any, Protocol

from vkbloom._lazy_modules import own_module
from vkbloom._settings.registry import METHODS


class Reference(Protocol):
    """A module of this package: a method in NumPy.

    ``passes(source, settings)`` returns the framebuffers after the glow, in the order of the data
    flow; the last one is "bloom". `source` is a `BlurInput`.
    ``gain(settings, size)`` returns the bloom of a flat image of 1; `size` is the width and height
    of the frame.

    A method with a composite of its own has ``composite(scene, light, settings, share)`` (as that
    of `_blending`), and ``slope(scene, settings)``, if its largest derivative by
    the light is not 1. ``strength(settings)`` is the factor of a bloom that has more than the
    intensity.
    """

    passes: Any
    gain: Any


def reference_of(method: str) -> Reference:
    """Return a method of the package in NumPy; raise KeyError for a custom one."""
    if method not in METHODS or METHODS.is_added(method):
        raise KeyError(method)
    module: Any = own_module(__package__, f"_{method}")
    return module  # type: ignore[no-any-return]
