"""Settings of the bloom methods of Godot, Blender and pygfx: one class for each engine.

As in `vkbloom.published`, they start from the complete frame, and apply the threshold where their
source does.
"""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom.checks import FLT_MAX, check_number
from vkbloom.published import check_no_knee
from vkbloom.settings import (
    BloomFormat,
    Composite,
    Settings,
    check_level_weights,
    flag_field,
    number_field,
)

__all__ = ["GODOT_LEVELS", "BlenderGlare", "GodotBloom", "PygfxBloom"]

#: Number of levels that have a weight in Godot.
GODOT_LEVELS = 7


@dataclasses.dataclass(frozen=True, kw_only=True)
class GodotBloom(Settings):
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
        instead of bilinearly.
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

    See Also
    --------
    presets : "godot_4_5" and "godot_4_6".

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
    ``bloom`` is the weighted sum of the enlarged levels. A weight up to 0.0001 counts as 0, and
    levels after the last weight that is not 0 do not exist.

    Source: godotengine/godot, servers/rendering/renderer_rd/shaders/effects: copy.glsl
    @ 0a5efd02df51, tonemap.glsl @ 001c8c9c24dc.

    Examples
    --------
    >>> vkbloom.GodotBloom().composite
    'screen'
    """

    method: ClassVar[str] = "godot"
    composites: ClassVar[tuple[Composite, ...]] = ("screen", "soft_light", "add", "replace", "mix")

    threshold: float | None = 1.0
    composite: Composite = "screen"
    intensity: float = number_field("intensity", default=0.3)
    format: BloomFormat | None = "rgba16float"
    threshold_scale: float = number_field("threshold_scale")
    luminance_cap: float = number_field("luminance_cap")
    glow_bloom: float = number_field("glow_bloom")
    strength: float = number_field("strength")
    level_weights: tuple[float, ...] = (0.0, 0.8, 0.4, 0.1, 0.0, 0.0, 0.0)
    bicubic: bool = flag_field("bicubic")
    white: float = number_field("white")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_no_knee(self)
        weights = check_level_weights(self.level_weights, GODOT_LEVELS)
        for weight in weights:
            check_number("level_weights", weight, 0, FLT_MAX)
        object.__setattr__(self, "level_weights", weights)


@dataclasses.dataclass(frozen=True, kw_only=True)
class BlenderGlare(Settings):
    """The bloom of Blender's Glare node, in high quality.

    Parameters
    ----------
    threshold : float or None
        Brightest channel from which a colour glows.
    smoothness : float
        Width of the soft parts of the threshold and of the maximum, 0 to 1.
    size : float
        Size of the glare as a share of the frame, 0 to 1.
    maximum : float or None
        Largest brightness above the threshold, 0 to 65504. None: no limit.
    composite : {"add"}
    intensity : float
        The node's strength, 0 to 1.
    **settings
        The other fields of `Settings`; there is no knee.

    See Also
    --------
    presets : "blender_bloom".

    Notes
    -----
    There are n = floor(log2(size * shorter side)) levels, at least one. ``down_0`` has the size of
    the frame. With v the brightest channel of a colour c, it is c (v' - threshold) / v, or 0 if
    v <= 0, with v' = smooth_min(smooth_max(v, threshold), threshold + maximum). smooth_min(a, b) is
    min(a, b) - h^2 k / 4 with h = max(1 - abs(a - b) / k, 0), and smooth_max is its mirror image. k
    is the smoothness, but not more than the distance of the end from 0 and from the other end.

    Each next level has half the size of the one before, floored, by the 13 taps of `Pyramid`. For
    ``down_1``, the four taps of each group are weighted by 1 / (1 + brightest channel).
    up_k = down_k + tent(up_k+1) with a tent of one pixel of the larger level, and ``bloom`` is
    up_0 / n. The other qualities, saturation and tint are not supported.

    Source: the formulas of the compositor of Blender 4.5, source/blender/nodes/composite/nodes/
    node_composite_glare.cc.

    Examples
    --------
    >>> vkbloom.BlenderGlare(size=0.25).size
    0.25
    """

    method: ClassVar[str] = "blender"
    composites: ClassVar[tuple[Composite, ...]] = ("add",)

    threshold: float | None = 1.0
    intensity: float = number_field("intensity", range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    smoothness: float = number_field("smoothness")
    # On the command line, --size is the size of a frame.
    size: float = number_field("size", option="glare-size")
    maximum: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_no_knee(self)


@dataclasses.dataclass(frozen=True, kw_only=True)
class PygfxBloom(Settings):
    """The PhysicalBasedBloomPass of pygfx.

    Parameters
    ----------
    levels : int
        Number of levels, 1 to 16; at most floor(log2(longer side of down_0)) + 1.
    filter_radius : float
        Distance of the tent's taps as a share of the width, 0 to 1.
    karis_average : bool
        Whether ``down_0`` is the mean of the five groups, weighted by 1 / (1 + luminance) only.
    threshold : None
        pygfx has none.
    composite : {"mix"}
    intensity : float
        The strength of pygfx, 0 to 1.
    **settings
        The other fields of `Settings`; there is no knee.

    See Also
    --------
    presets : "pygfx".

    Notes
    -----
    ``down_0`` has half the size of the frame, each next level half of the one before, floored, by
    the 13 taps of `Pyramid`. Negative values become 0. up_k = down_k + tent(up_k+1). The taps of
    the tent are `filter_radius` of the smaller level's width apart along both axes. ``bloom`` is
    one bilinear sample of up_0, the sum of the levels.

    Source: pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c.

    Examples
    --------
    >>> vkbloom.PygfxBloom().levels
    6
    """

    method: ClassVar[str] = "pygfx"
    composites: ClassVar[tuple[Composite, ...]] = ("mix",)

    composite: Composite = "mix"
    intensity: float = number_field("intensity", default=0.04, range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    levels: int = number_field("levels")
    filter_radius: float = number_field("filter_radius")
    karis_average: bool = flag_field("karis_average")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_no_knee(self)
        if self.threshold is not None:
            raise ValueError(f"threshold: {self.threshold!r} is not None; pygfx has no threshold")
