"""Glare under its published names: stages for the field `Settings.glare`.

``docs/glare.md`` has the source of each, and the differences from the source.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from vkbloom._glare.dirt import Dirt
from vkbloom._glare.flares import Ghosts, Halo
from vkbloom._glare.streaks import Streaks

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom._settings.glare import Glare


def _filament() -> tuple[Glare, ...]:
    """Return four ghosts of the spacing 0.6 and a halo, with the strength of the bloom."""
    scales = tuple(0.6 * ghost - 1 for ghost in range(4))
    reads: Any = {"threshold": 10, "maximum": 1, "aberration": 0.005, "halvings": 1}
    return (
        Ghosts(scales=scales, falloff=0, intensity=0.1, **reads),
        Halo(radius=0.4, width=0.1, intensity=0.1, **reads),
    )


def _unreal() -> tuple[Glare, ...]:
    """Return eight ghosts, which are drawn 7 A - 3.5 times as large as the picture."""
    tints = {
        0.60: (1.0, 0.8, 0.4),
        0.53: (1.0, 1.0, 0.6),
        0.46: (0.8, 0.8, 1.0),
        0.39: (0.5, 1.0, 0.4),
        0.31: (0.5, 0.8, 1.0),
        0.27: (0.9, 1.0, 0.8),
        0.22: (1.0, 0.8, 0.4),
        0.15: (0.9, 0.7, 0.7),
    }
    scales = tuple(1 / (7 * alpha - 3.5) for alpha in tints)
    look: Any = {"threshold": 8 / 3, "falloff": 2, "radius": math.sqrt(0.5), "halvings": 4}
    return (Ghosts(scales=scales, tints=tuple(tints.values()), **look),)


def _blender_ghosts() -> tuple[Glare, ...]:
    """Return the first of the iterations that Blender adds up, for its two blurs."""
    # Of three iterations, and a modulation of colours of 0.25.
    scales = [2.1 * (1 - (4.5 + ghost) / 12) for ghost in range(4)]
    scales[1::2] = [-0.99 / scale for scale in scales[1::2]]
    tints = ((1.0, 1.0, 1.0), (1.0, 0.75, 0.75), (0.75, 0.75, 1.0), (0.75, 1.0, 0.75))
    look: Any = {"tints": tints, "falloff": 1, "radius": 0.5, "threshold": 1, "intensity": 0.25}
    return tuple(
        Ghosts(scales=tuple(base * scale for scale in scales), halvings=halvings, **look)
        for base, halvings in ((2.13, 3), (-0.97, 4))
    )


def _blender_streaks() -> tuple[Glare, ...]:
    """Return streaks. Blender halves the sum of four taps and does not average the streaks."""
    gain = 4 / 3
    for iteration in range(3):
        gain *= sum(0.9 ** (tap * 4**iteration) for tap in range(4)) / 2
    look: Any = {"directions": 4, "fade": 0.9, "iterations": 3, "colour_shift": 0.25}
    return (Streaks(threshold=1, intensity=gain, halvings=1, **look),)


_LONG_TAPS: Any = {"fade": 0.97, "base": 6, "iterations": 3}
_URP_SCALE = 1.25**1.5


class NamedGlare(NamedTuple):
    """Stages, what they look like, and whose they are."""

    stages: tuple[Glare, ...]
    what: str
    whose: str


#: The glares by name.
GLARES: Final[Mapping[str, NamedGlare]] = {
    "filament_flare": NamedGlare(
        _filament(),
        "four ghosts and a halo of what is above 10",
        "google/filament, flare.mat @ 523a261b1052, Options.h @ 044f3ebdf780",
    ),
    "three_lensflare": NamedGlare(
        (Ghosts(scales=(-1.0, -0.75, -0.5, -0.25), threshold=0.5, falloff=25, radius=1),),
        "four ghosts of what is above 0.5, near the centre",
        "mrdoob/three.js, LensflareNode.js @ 0a0cd97338d3",
    ),
    "urp_flare": NamedGlare(
        (Ghosts(scales=(1 / _URP_SCALE, -1 / _URP_SCALE), falloff=0, vignette=1, intensity=0.1),),
        "a regular and a reversed copy of what glows, with the intensity 1",
        "Unity URP, LensFlareScreenSpaceCommon.hlsl @ 0e4ca4d79b2c",
    ),
    "unreal_flare": NamedGlare(
        _unreal(),
        "eight tinted ghosts, without the bokeh",
        "Unreal Engine, PostProcessLensFlares.cpp (formulas)",
    ),
    "blender_ghosts": NamedGlare(
        _blender_ghosts(),
        "eight ghosts of what is above 1",
        "Blender 5, Glare node, Ghosts (formulas)",
    ),
    "blender_streaks": NamedGlare(
        _blender_streaks(),
        "a star of four streaks of what is above 1",
        "Blender 5, Glare node, Streaks (formulas)",
    ),
    "anamorphic": NamedGlare(
        (Streaks(directions=1, threshold=1, intensity=0.3, halvings=1, **_LONG_TAPS),),
        "a long horizontal streak of what is above 1",
        "vkbloom, after anamorphic lenses",
    ),
    "godot_dirt": NamedGlare(
        (Dirt(strength=0.8, mode="lerp"),),
        "generated dirt on the lens, lit by the bloom, with the strength 0.8",
        "Godot, glow map of tonemap.glsl @ 001c8c9c24dc",
    ),
}
