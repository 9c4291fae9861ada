"""Bloom of Unity's two render pipelines."""

from __future__ import annotations

import dataclasses
from typing import ClassVar, Literal

from vkbloom._settings.fields import choice_field, flag_field, number_field, value_field
from vkbloom._settings.settings import BloomFormat, Composite, Settings, no_knee

BlurFilter = Literal["gaussian", "kawase", "dual"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class UrpBloom(Settings):
    """Bloom of Unity's Universal Render Pipeline, without high quality.

    Parameters
    ----------
    filter : {"gaussian", "kawase", "dual"}
        How the bloom spreads. The last two are of URP 17 (Unity 6).
    scatter : float
        Share of the larger blurs, 0 to 1.
    iterations : int
        Largest number of levels, 2 to 8.
    clamp_max : float
        Limit of the values that enter the bloom, 0 to 65504.
    threshold : float or None
        In linear light; Unity shows the default as 0.9 in sRGB.
    knee : float
        In Unity it is 0.5 and cannot be set.
    composite : {"add"}
    intensity : float
        Unity's default is 0, which is off.
    **settings
        The other fields of `Settings`.

    Notes
    -----
    ``down_0`` is one bilinear tap at half of the frame's size, floored. It is clamped; then the
    knee curve is applied, with k = threshold * knee, 4k + 1e-4 and 1e-4. There are
    clamp(floor(log2(longer side of down_0) - 1), 1, iterations) levels. Each next level has half
    the size, floored, by the half-kernel 0.22702703, 0.19459459, 0.12162162, 0.05405405,
    0.01621622. Its horizontal taps are two texels of the level above apart; the vertical taps,
    which follow, one pixel. With s = 0.05 + 0.9 scatter, up_k = lerp(down_k, bilinear(up_k+1), s),
    and ``bloom`` is one bilinear sample of up_0. Dirt and tint are not supported.

    "kawase" stays at the size of down_0. As many times as there are levels, n, kawase_i mixes the
    image before with the mean of four diagonal taps, D = 1/2 + i texels away (i - 1 where i is
    above floor(n / 2)), by s, or takes the mean alone if the scatter is 0.999 or more. "dual"
    makes the levels as `DualKawase` does with the offset 1, and goes up with the offset
    0.3 + scatter without adding them.

    Source: Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.universal:
    Shaders/PostProcessing/Bloom.shader @ 00d472fae509,
    Runtime/Passes/PostProcess/BloomPostProcessPass.cs @ 13e28e026298,
    Runtime/Overrides/Bloom.cs @ a085de35f86e.

    Examples
    --------
    >>> round(vkbloom.UrpBloom().threshold, 4)
    0.7874
    """

    method: ClassVar[str] = "urp"
    published: ClassVar[bool] = True

    threshold: float | None = ((0.9 + 0.055) / 1.055) ** 2.4  # 0.9 in sRGB
    composite: Composite = choice_field("composite", ("add",))
    knee: float = number_field("knee", default=0.5)
    format: BloomFormat | None = "rgba16float"
    filter: BlurFilter = choice_field("filter")
    scatter: float = number_field("scatter")
    iterations: int = number_field("iterations")
    clamp_max: float = number_field("clamp_max", slider=(0, 100))


@dataclasses.dataclass(frozen=True, kw_only=True)
class HdrpBloom(Settings):
    """Bloom of Unity's High Definition Render Pipeline, without a threshold, at half resolution.

    Parameters
    ----------
    scatter : float
        Share of the larger blurs, 0 to 1.
    high_quality_filtering : bool
        Whether to enlarge the levels by a cubic B-spline instead of bilinearly. It has no effect on
        frames with less than 800 pixels in width or 450 in height.
    anamorphism : float
        Of the camera, -1 to 1, as with HDRP's switch "anamorphic". Positive values stretch the
        bloom along y, negative ones along x.
    threshold : None
        HDRP's default. With a threshold, HDRP replaces the part of the scene above it. This
        composite is not supported.
    composite : {"mix"}
    intensity : float
        0 to 1. It is 2^i - 1 of the intensity i that HDRP shows, whose default is 0 (off).
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    Level k has the size of the frame / 2^(k + 1), rounded, ties to even. There are
    clamp(floor(log2(longer side of the frame) - 2), 1, 16) levels. An `anamorphism` a < 0 first
    multiplies the width of the frame by 1 + a / 2, one above 0 its height by 1 - a / 2. Five
    bilinear taps, at (0, 0), +-(0.9, -0.4) and +-(0.4, 0.9) in texels of the frame, weighted by
    1 / (1 + luminance), are stored at the size of ``down_0``. ``down_0`` is this image, blurred.
    Each next level is the one before, read bilinearly at distances of one pixel of the next level,
    and blurred. The blur is the binomial 70, 56, 28, 8, 1 (/ 256) along both axes. With
    s = 0.05 + 0.9 scatter, up_k = lerp(down_k, U(up_k+1), s); ``bloom`` is the cubic B-spline of
    up_0. Dirt and tint are not supported.

    Source: Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.high-definition/
    Runtime: PostProcessing/Shaders/BloomPrefilter.compute @ 2309d2c2fde8, BloomBlur.compute and
    BloomUpsample.compute @ 0e4ca4d79b2c, PostProcessing/Components/Bloom.cs @ 2084a9d19159,
    RenderPipeline/HDRenderPipeline.PostProcess.cs @ 0148835ea9ba.

    Examples
    --------
    >>> vkbloom.HdrpBloom(scatter=0.5).composite
    'mix'
    """

    method: ClassVar[str] = "hdrp"
    published: ClassVar[bool] = True

    threshold: float | None = value_field(
        None, fixed="the composite that HDRP uses with a threshold is not supported"
    )
    knee: float = no_knee("hdrp")
    composite: Composite = choice_field("composite", ("mix",))
    intensity: float = number_field("intensity", default=2**0.2 - 1, range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    scatter: float = number_field("scatter")
    high_quality_filtering: bool = flag_field("high_quality_filtering")
    anamorphism: float = number_field("anamorphism")
