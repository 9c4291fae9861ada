"""The stages of glare, which read what glows and add light to the bloom.

The field `Settings.glare` is a tuple of stages. The core declares their numbers
(``shaders/params.h``). `vkbloom._settings.registry.STAGES` has the order of the stages.
"""

from __future__ import annotations

from vkbloom._settings.registry import STAGES

STAGES.supply(
    __package__,
    {
        "streaks": "streaks:Streaks",
        "ghosts": "flares:Ghosts",
        "halo": "flares:Halo",
        "dirt": "dirt:Dirt",
    },
)
