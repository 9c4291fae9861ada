"""The usual composite of scene and light, and what follows it: exposure and tone map."""

from __future__ import annotations

import numpy as np

from vkbloom._settings.settings import Settings

from ._sampling import Array
from ._tone_map import TONE_MAPS


def composite(scene: Array, light: Array, settings: Settings, share: float | Array) -> Array:
    """Return scene and light after the tone map; `Reference.composite` of most methods."""
    return develop(blend(scene, light, settings.composite, settings.intensity, share), settings)


def blend(scene: Array, light: Array, mode: str, intensity: float, share: float | Array) -> Array:
    """Return the combination of scene and light, which is i b."""
    if mode == "add":
        return scene + light
    if mode == "mix":
        return scene + light - intensity * share * scene
    if mode == "screen":
        return 1 - (1 - np.clip(scene, 0, 1)) * (1 - np.clip(light, 0, 1))
    raise ValueError(f'composite: {mode!r} is not "add", "mix" or "screen"')


def develop(rgb: Array, settings: Settings) -> Array:
    """Return colours after the exposure and the tone map."""
    return TONE_MAPS[settings.tonemap](rgb * 2.0**settings.exposure)
