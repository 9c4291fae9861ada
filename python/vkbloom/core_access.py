"""The core of a renderer, for modules of the package that submit work of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from vkbloom import _core

__all__ = ["HasCore", "core_of"]


class HasCore(Protocol):
    """A `vkbloom.Renderer`; a protocol, because the renderer's module imports some of the users."""

    _core: _core.Renderer


def core_of(renderer: HasCore) -> _core.Renderer:
    """Return the core of a renderer: surfaces, grids, files and the explorer run plans on it."""
    return renderer._core
