"""Exposures under their published names. ``docs/exposure.md`` has the source of each."""

from __future__ import annotations

from typing import Final

from vkbloom._exposure.bevy import BevyExposure
from vkbloom._exposure.fixed import FixedExposure
from vkbloom._exposure.godot import GodotExposure
from vkbloom._exposure.granite import GraniteExposure
from vkbloom._exposure.o3de import O3deExposure
from vkbloom._exposure.unity import HdrpExposure, PostProcessingExposure
from vkbloom._settings.named import NamedEntry

PRESETS: Final = {
    "fixed": NamedEntry(FixedExposure, "no change; 0 stops", "vkbloom"),
    "bevy": NamedEntry(BevyExposure, "histogram of 64 bins, steps of stops", "Bevy"),
    "hdrp": NamedEntry(HdrpExposure, "histogram of 128 bins, exponential", "Unity HDRP"),
    "hdrp_automatic": NamedEntry(
        lambda: HdrpExposure(mode="automatic"), "weighted log mean, exponential", "Unity HDRP"
    ),
    "ppv2": NamedEntry(
        PostProcessingExposure,
        "histogram of 128 bins, exponential in the multiplier",
        "Unity Post Processing v2",
    ),
    "godot": NamedEntry(GodotExposure, "mean of the brightest channel", "Godot"),
    "o3de": NamedEntry(O3deExposure, "mean of the luminance with bloom", "O3DE"),
    "granite": NamedEntry(GraniteExposure, "log mean of the brightest channel", "Granite"),
}
