"""The exposures of engines: how a frame is metered, and how the exposure follows.

`vkbloom.exposures` has them under their published names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vkbloom._settings.registry import EXPOSURES, NAMED_EXPOSURES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom._settings.named import NamedEntry

EXPOSURES.supply(
    __package__,
    {
        "fixed": "fixed:FixedExposure",
        "keyframed": "fixed:KeyframedExposure",
        "bevy": "bevy:BevyExposure",
        "hdrp": "unity:HdrpExposure",
        "ppv2": "unity:PostProcessingExposure",
        "godot": "godot:GodotExposure",
        "o3de": "o3de:O3deExposure",
        "granite": "granite:GraniteExposure",
    },
)


def _presets() -> Mapping[str, NamedEntry]:
    from vkbloom._exposure.presets import PRESETS  # noqa: PLC0415  costs start-up time

    return PRESETS


NAMED_EXPOSURES.fill(_presets)
