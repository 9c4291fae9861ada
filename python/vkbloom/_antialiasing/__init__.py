"""Temporal anti-aliasing of engines: how a frame is mixed with those before it.

`vkbloom.antialiasing` has it under the engines' names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vkbloom._settings.registry import ANTIALIASINGS, NAMED_ANTIALIASINGS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom._settings.named import NamedEntry

ANTIALIASINGS.supply(
    __package__,
    {
        "bevy": "bevy:BevyAntialiasing",
        "godot": "godot:GodotAntialiasing",
        "o3de": "o3de:O3deAntialiasing",
        "hdrp": "unity:HdrpAntialiasing",
    },
)


def _presets() -> Mapping[str, NamedEntry]:
    from vkbloom._antialiasing.presets import PRESETS  # noqa: PLC0415  costs start-up time

    return PRESETS


NAMED_ANTIALIASINGS.fill(_presets)
