"""Godot's glow."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from vkbloom._formats import MAX_FLOAT
from vkbloom._public import public
from vkbloom._settings.fields import choice_field, flag_field, number_field, numbers_field
from vkbloom._settings.pass_sentences import BLURRED_DOWN
from vkbloom._settings.settings import Composite, PublishedSettings

#: Number of levels that have a weight in Godot.
GODOT_LEVELS = 7


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class GodotBloom(PublishedSettings):
    """Godot's glow, by default that of 4.6.

    Parameters
    ----------
    threshold : float or None
        Brightest channel from which a colour glows; Godot's HDR threshold.
    threshold_scale : float
        Brightness over which the threshold fades in, 0 to 65504.
    luminance_cap : float
        Largest value of a channel of ``down_0``, 0 to 65504.
    glow_bloom : float
        Share of every colour that glows regardless of the threshold, 0 to 1.
    strength : float
        Factor of each level's blur, 0 to 16.
    level_weights : sequence of float
        Seven weights, one for each level, 0 or more.
    bicubic : bool
        Whether to enlarge the levels by the cubic B-spline, as Godot does on desktop systems,
        instead of bilinearly, as its mobile renderer did up to 4.5.
    white : float
        Largest brightness of the composite "screen", 0.01 to 65504.
    composite : {"screen", "soft_light", "add", "replace", "mix"}
        With s the scene and g the bloom times the intensity i. "screen": s + g - s g / white with g
        clamped to 0..white. "soft_light": s + g (f(s) - s) with s and g after the tone map, g
        clamped to 0..1, and f(s) = ((16 s - 12) s + 4) s up to 1/4, then sqrt(s), and s above 1.
        "add": s + g. "replace": g. "mix": (1 - i) s + g.
    exposure : float
        In stops. It multiplies the scene before the composite, and ``down_0`` before the threshold.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    Level i has the size floor(side / 2) >> i of the frame, at least 1. It is the image above it
    (for level 0 the frame), read bilinearly at the level's pixel centres. It is blurred by the
    half-kernel 0.2024, 0.1790, 0.1240, 0.0672, 0.0285 along both axes, and multiplied by the
    strength. Samples are read in pairs: place n reads clamp(2 floor(n / 2), 0, W - 2) + n mod 2. So
    the last two repeat beyond the border, and the last pixel of an odd width reads the one before
    it. Sides of 1 are undefined in Godot; here all their places read the one sample.

    In the first level, c is divided by 1 + L before the blur and by 1 - L after it, with
    L = max((0.299, 0.587, 0.114) . c, 0) / max(cap, 6). Strength and exposure follow, then the
    factor max(smoothstep(threshold, threshold + scale, max(c)), glow_bloom), then the cap.
    ``bloom`` is the weighted sum of the enlarged levels. Those with a weight up to 0.0001 are left
    out of it, and levels after the last one that has a greater weight do not exist.

    Source: godotengine/godot, servers/rendering/renderer_rd/shaders/effects: copy.glsl
    @ 0a5efd02df51, tonemap.glsl @ 001c8c9c24dc.
    """

    method: ClassVar[str] = "godot"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "strength", "glow_bloom")
    _fields_before_composite: ClassVar[frozenset[str]] = frozenset(("exposure",))
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": BLURRED_DOWN})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "threshold_scale", "glow_bloom")

    threshold: float | None = 1.0
    composite: Composite = choice_field(("screen", "soft_light", "add", "replace", "mix"))
    intensity: float = number_field(default=0.3)
    threshold_scale: float = number_field(slider=(0, 8))
    luminance_cap: float = number_field(slider=(0, 48), everyday=0)
    glow_bloom: float = number_field()
    strength: float = number_field(slider=(0, 2))
    level_weights: tuple[float, ...] = numbers_field(
        (0.0, 0.8, 0.4, 0.1, 0.0, 0.0, 0.0), high=MAX_FLOAT
    )
    bicubic: bool = flag_field()
    white: float = number_field(slider=(1, 16), everyday=0)
