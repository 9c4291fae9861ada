"""Blooms of settings as functions of an image."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.settings import Settings
from vkbloom.testing._probe import Bloom


def exact(settings: Settings) -> Settings:
    """Return the settings with buffers of floats, and nothing after the composite."""
    plain = settings.replace(tonemap="none", encoding="none", exposure=0.0, dither=False)
    return plain if plain.format is not None else plain.replace(format="rgba32float")


def bloom_of(renderer: Renderer, settings: Settings, framebuffer: str) -> Bloom:
    """Return the colours of a framebuffer as a function of the image."""

    def bloom(image: NDArray[Any]) -> NDArray[Any]:
        result = renderer.apply(image, settings, framebuffers=framebuffer)[framebuffer]
        return result[..., : image.shape[2]]

    return bloom
