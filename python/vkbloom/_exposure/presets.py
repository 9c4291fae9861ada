"""Exposures under their published names. ``docs/exposure.md`` has the source of each."""

from __future__ import annotations

from typing import Final

from vkbloom._exposure.bevy import BevyExposure
from vkbloom._exposure.fixed import FixedExposure
from vkbloom._exposure.godot import GodotExposure
from vkbloom._exposure.granite import GraniteExposure
from vkbloom._exposure.o3de import O3deExposure
from vkbloom._exposure.unity import HdrpExposure, PostProcessingExposure
from vkbloom._settings.exposure import NamedExposure

PRESETS: Final = {
    "fixed": NamedExposure(FixedExposure, "no change; 0 stops", "vkbloom"),
    "bevy": NamedExposure(BevyExposure, "histogram of 64 bins, steps of stops", "Bevy"),
    "hdrp": NamedExposure(HdrpExposure, "histogram of 128 bins, exponential", "Unity HDRP"),
    "hdrp_automatic": NamedExposure(
        lambda: HdrpExposure(mode="automatic"), "weighted log mean, exponential", "Unity HDRP"
    ),
    "ppv2": NamedExposure(
        PostProcessingExposure,
        "histogram of 128 bins, exponential in the multiplier",
        "Unity Post Processing v2",
    ),
    "godot": NamedExposure(GodotExposure, "mean of the brightest channel", "Godot"),
    "o3de": NamedExposure(O3deExposure, "mean of the luminance with bloom", "O3DE"),
    "granite": NamedExposure(GraniteExposure, "log mean of the brightest channel", "Granite"),
}
