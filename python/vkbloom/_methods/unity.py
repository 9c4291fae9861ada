"""Bloom of Unity's two render pipelines, and of the package before them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from vkbloom._formats import LUMINANCE_7_DIGITS, MAX_HALF
from vkbloom._public import public
from vkbloom._settings.fields import (
    choice_field,
    flag_field,
    number_field,
    numbers_field,
    value_field,
)
from vkbloom._settings.pass_sentences import (
    BLURRED_DOWN,
    DOUBLED_BY_8,
    HALVED_BY_5,
    HALVED_BY_13,
)
from vkbloom._settings.settings import Composite, PublishedSettings

BlurFilter = Literal["gaussian", "kawase", "dual"]


def _linear(value: float) -> float:
    """Return the light of a value in sRGB; above 1 it is a power of 2.2, as Unity converts it."""
    if value > 1:
        return float(value**2.2)
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class UrpBloom(PublishedSettings):
    """Bloom of Unity's Universal Render Pipeline.

    Parameters
    ----------
    filter : {"gaussian", "kawase", "dual"}
        How the bloom spreads. The last two are of version 17.
    downscale : {"half", "quarter"}
        Size of the first level as a share of the frame's.
    high_quality : bool
        Whether to reduce the frame by 13 taps, and to enlarge by a cubic B-spline.
    scatter : float
        Share of the larger blurs, 0 to 1.
    iterations : int
        Largest number of levels, 2 to 8.
    tint : tuple of 3 floats
        In sRGB. Its light, divided by its luminance, multiplies the bloom; black counts as white.
    clamp : float
        Limit of the values that enter the bloom, 0 to 65504.
    version : {"17", "12"}
        Of the package: 17 is that of Unity 6.
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
    ``down_0`` is one bilinear tap at half or a quarter of the frame's size, floored, or 13 taps up
    to a texel apart (12 takes a texel's width for its height). It is clamped; then the knee curve
    is applied, with k = threshold * knee, 4k + 1e-4 and 1e-4. There are
    clamp(floor(log2(longer side of down_0) - 1), 1, iterations) levels. Each next level has half
    the size, floored, by the half-kernel 0.22702703, 0.19459459, 0.12162162, 0.05405405,
    0.01621622. Its horizontal taps are two texels of the level above apart; the vertical taps,
    which follow, one pixel. In 17 no horizontal tap is beyond the middle of the last two columns.
    With s = 0.05 + 0.9 scatter, up_k = lerp(down_k, bilinear(up_k+1), s), and ``bloom`` is one
    bilinear sample of up_0, times the tint. Dirt is not supported.

    "kawase" stays at the size of down_0. As many times as there are levels, n, kawase_i mixes the
    image before with the mean of four diagonal taps, D = 1/2 + i texels away (i - 1 where i is
    above floor(n / 2)), by s, or takes the mean alone if the scatter is 0.999 or more. "dual"
    makes the levels as `DualKawase` does with the offset 1, and goes up with the offset
    0.3 + scatter without adding them.

    Source: Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.universal:
    Shaders/PostProcessing/Bloom.shader @ 00d472fae509,
    Runtime/Passes/PostProcess/BloomPostProcessPass.cs @ 13e28e026298,
    Runtime/Overrides/Bloom.cs @ a085de35f86e.
    """

    method: ClassVar[str] = "urp"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "scatter")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"down": "makes the next smaller level and blurs it"}
    )
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "knee")

    threshold: float | None = ((0.9 + 0.055) / 1.055) ** 2.4  # 0.9 in sRGB
    knee: float = number_field(fixed="", default=0.5)
    filter: BlurFilter = choice_field()
    scatter: float = number_field()
    iterations: int = number_field()
    downscale: Literal["half", "quarter"] = choice_field(("half", "quarter"))
    high_quality: bool = value_field(False)
    tint: tuple[float, float, float] = numbers_field((1.0, 1.0, 1.0))
    clamp: float = number_field(core="clamp_max", slider=(0, 100), everyday=0)
    version: Literal["17", "12"] = choice_field(("17", "12"))

    def _pass_sentence(self, stem: str) -> str:
        dual = {"down": HALVED_BY_5, "up": DOUBLED_BY_8} if self.filter == "dual" else {}
        return dual.get(stem) or super()._pass_sentence(stem)

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        colour = [_linear(channel) for channel in self.tint]
        grey = sum(map(math.prod, zip(colour, LUMINANCE_7_DIGITS, strict=True)))
        return {
            "quarter": self.downscale == "quarter",
            "high_quality_filtering": self.high_quality,
            "tint": [channel / grey for channel in colour] if grey else (1.0, 1.0, 1.0),
            "clamp_max": self.clamp,
            "urp_12": self.version == "12",
        }


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class HdrpBloom(PublishedSettings):
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
    """

    method: ClassVar[str] = "hdrp"
    _knobs: ClassVar[tuple[str, ...]] = ("scatter",)
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": BLURRED_DOWN})

    threshold: float | None = value_field(
        None, fixed="the composite that HDRP uses with a threshold is not supported"
    )
    composite: Composite = choice_field(("mix",))
    intensity: float = number_field(default=2**0.2 - 1, range=(0, 1))
    scatter: float = number_field()
    high_quality_filtering: bool = flag_field()
    anamorphism: float = number_field(differentiable=False)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class PostProcessingBloom(PublishedSettings):
    """Bloom of Unity's Post Processing Stack v2.

    Parameters
    ----------
    threshold : float or None
        In sRGB, as Unity shows it; above 1 its light is a power of 2.2.
    knee : float
        The engine's soft knee, 0 to 1.
    clamp : float
        Limit of the values that enter the bloom, in sRGB as the threshold, 0 to 65504.
    diffusion : float
        Width of the bloom, 1 to 10.
    anamorphic_ratio : float
        Below 0 the first level is wider, above 0 higher; -1 to 1.
    fast : bool
        Whether to read four taps in place of 13 and of nine.
    color : tuple of 3 floats
        Factors of the channels in linear light.
    composite : {"add"}
    intensity : float
        2^(i / 10) - 1 of the intensity i that Unity shows, whose default is 0 (off).
    **settings
        The other fields of `Settings`.

    Notes
    -----
    ``down_0`` has the size floor(side / 2) of the frame; a negative ratio a divides the width by
    2 + a, a positive one the height by 2 - a. With l = log2(longer side) + diffusion - 10 there are
    clamp(floor(l), 1, 16) levels, each half of the one before, floored, and the tent's radius is
    1/2 + l - floor(l) texels. Each level reads the 13 taps of `Pyramid` at half of their distances,
    with `fast` the mean of four at (+-1, +-1). down_0 is clamped; then the knee curve of `Settings`
    is applied, with k = threshold * knee + 1e-5, 4k and 1e-4, and the colour. up_k = down_k +
    tent(up_k+1) and ``bloom`` is tent(up_0); with `fast` the tent is the mean of four samples at
    half of the radius. The auto exposure is 1; dirt is not supported.

    Source: Unity-Technologies/PostProcessing @ 32c3155207d3:
    PostProcessing/Shaders/Builtins/Bloom.shader, PostProcessing/Shaders/Sampling.hlsl,
    PostProcessing/Runtime/Effects/Bloom.cs.
    """

    method: ClassVar[str] = "post_processing"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "diffusion")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "knee")

    threshold: float | None = number_field(default=1.0, slider=(0, 4))
    knee: float = number_field(fixed="", default=0.5)
    clamp: float = number_field(core="clamp_max", slider=(0, 100), everyday=0)
    diffusion: float = number_field(differentiable=False)
    anamorphic_ratio: float = number_field(core="anamorphism", differentiable=False)
    fast: bool = flag_field()
    color: tuple[float, float, float] = numbers_field((1.0, 1.0, 1.0))

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {
            "threshold": None if self.threshold is None else _linear(self.threshold),
            "clamp_max": min(MAX_HALF, _linear(self.clamp)),
            "anamorphism": self.anamorphic_ratio,
            "tint": self.color,
        }

    def _threshold_slopes(self) -> dict[str, float]:
        slopes = super()._threshold_slopes()
        if self.threshold is not None:
            # At a kink of the curve this is the mean of both sides. The truncated terms are 1e-10.
            step = 1e-5
            ends = _linear(self.threshold + step) - _linear(self.threshold - step)
            slopes["threshold"] = ends / (2 * step)
        return slopes
