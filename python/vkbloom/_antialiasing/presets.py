"""Temporal anti-aliasing under published names. ``docs/exposure.md`` has the source of each."""

from __future__ import annotations

from typing import Final

from vkbloom._antialiasing.bevy import BevyAntialiasing
from vkbloom._antialiasing.godot import GodotAntialiasing
from vkbloom._antialiasing.o3de import O3deAntialiasing
from vkbloom._antialiasing.unity import HdrpAntialiasing
from vkbloom._settings.named import NamedEntry

PRESETS: Final = {
    "bevy": NamedEntry(BevyAntialiasing, "variance of 3 x 3, confidence", "Bevy"),
    "godot": NamedEntry(GodotAntialiasing, "weighted variance, count of frames", "Godot"),
    "o3de": NamedEntry(O3deAntialiasing, "filtered frame, variance of 3 x 3", "O3DE"),
    "hdrp": NamedEntry(HdrpAntialiasing, "variance of 5, sharpened", "Unity HDRP, medium"),
    "hdrp_low": NamedEntry(
        lambda: HdrpAntialiasing(quality="low"), "range of 5, sharpened", "Unity HDRP, low"
    ),
    "hdrp_high": NamedEntry(
        lambda: HdrpAntialiasing(quality="high"),
        "filtered frame, variance of 3 x 3, sharpened",
        "Unity HDRP, high",
    ),
}
