"""Settings of the bloom methods of engines: one class for each engine.

The parameters have the names, defaults and ranges of their sources, as far as the core's table of
numbers (``shaders/params.h``) has them. All these methods start from the complete frame
(``bloom_scale`` is 1 in scenes, too), reduce it by their own rules, and apply the threshold where
their source does. So ``glow`` is the input of the method, not the result of the threshold. Their
buffers are half floats unless ``format`` is set, since the buffers of the sources are floats.
"""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom.settings import BloomFormat, Composite, Settings, flag_field, number_field

__all__ = ["BevyBloom", "FilamentBloom", "HdrpBloom", "KinoBloom", "UnrealBloom", "UrpBloom"]


def _linear(encoded: float) -> float:
    """Return the linear value of an sRGB value above 0.04045. Engines show thresholds in sRGB."""
    return float(((encoded + 0.055) / 1.055) ** 2.4)


def check_no_knee(settings: Settings) -> None:
    """Raise ValueError for a knee if the threshold of the method has none."""
    if settings.knee != 0:
        raise ValueError(
            f"knee: {settings.knee!r} is not 0; the threshold of the method {settings.method} has "
            "no knee"
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class BevyBloom(Settings):
    """Bevy's bloom, by default its ``Bloom::NATURAL``.

    Parameters
    ----------
    low_frequency_boost : float
        Additional share of the larger blurs beyond `intensity`, 0 to 1.
    low_frequency_boost_curvature : float
        Curvature of the boost over the levels, 0 to 0.99. With more, it rises at smaller blurs.
    high_pass_frequency : float
        Share of the levels, counted from the smallest blur, that are not attenuated, 0.001 to 1.
    max_mip_dimension : int
        Height of ``down_0`` in pixels, 4 to 4096.
    scale_x, scale_y : float
        Bevy's scale: factors of the distances of all taps, 0 to 16. Its ``Bloom::ANAMORPHIC`` is
        ``scale_x=4, max_mip_dimension=1024``.
    composite : {"mix", "add"}
        Bevy's "energy conserving" and "additive".
    intensity : float
        0 to 1. It also changes the shares of the levels.
    threshold, knee : float
        Bevy's threshold and threshold softness. The knee curve is used even with a knee of 0.
    **settings
        The other fields of `Settings`.

    See Also
    --------
    presets : "bevy_natural" and others.
    Pyramid : A chain with the same downsample.

    Notes
    -----
    ``down_0`` is `max_mip_dimension` high; its width follows from the aspect of the frame
    (rounded, at most 16384). It is the sum of the five groups of the 13 taps of Jimenez, in texels
    of the frame. Each group p, multiplied by its share, is divided by 1 + luminance(p) / 4. The sum
    is at least 0.0001; then the threshold is applied. There are
    N = floor(log2(max_mip_dimension)) - 1 levels. Each next level has half the size, floored, by
    the plain 13 taps. For level m, with x = m / (N - 1), f_m is

        (intensity + (1 - (1 - x)^(1 / (1 - curvature))) * boost * (1 - intensity))
        * (1 - clamp((x - high_pass) / high_pass, 0, 1)),

    without the factor 1 - intensity if the composite is "add". With "mix",
    up_k = (1 - f_k+1) down_k + f_k+1 tent(up_k+1); with "add", down_k + f_k+1 tent(up_k+1). The
    tent is that of `Pyramid` with a radius of 1. `scale_x` and `scale_y` multiply the distances of
    all these taps. Bevy's last step, lerp(scene, tent(up_0), f_0), is the composite, since f_0 is
    the intensity.

    Source: bevyengine/bevy, tag v0.19.1 (b56fc29d3016), crates/bevy_post_process/src/bloom.

    Examples
    --------
    >>> vkbloom.BevyBloom(intensity=0.3).composite
    'mix'
    """

    method: ClassVar[str] = "bevy"
    composites: ClassVar[tuple[Composite, ...]] = ("mix", "add")

    composite: Composite = "mix"
    intensity: float = number_field("intensity", default=0.15, range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    low_frequency_boost: float = number_field("low_frequency_boost")
    low_frequency_boost_curvature: float = number_field("low_frequency_boost_curvature")
    high_pass_frequency: float = number_field("high_pass_frequency")
    max_mip_dimension: int = number_field("max_mip_dimension", unit="pixel")
    scale_x: float = number_field("scale_x")
    scale_y: float = number_field("scale_y")


@dataclasses.dataclass(frozen=True, kw_only=True)
class KinoBloom(Settings):
    """Keijiro Takahashi's KinoBloom, version 2, in its high quality.

    Parameters
    ----------
    radius : float
        Of the blur, 1 to 7. An increase by one doubles the width.
    anti_flicker : bool
        Whether to take the median of five pixels before the threshold, and to weight the four taps
        of the first level by 1 / (1 + brightest channel).
    threshold : float or None
        In linear light; KinoBloom shows the default as 0.8 in sRGB.
    knee : float
        KinoBloom's "soft knee".
    composite : {"add"}
    **settings
        The other fields of `Settings`.

    See Also
    --------
    presets : "kino".

    Notes
    -----
    ``bright`` has the size of the frame. It is m = median(median(c, left, right), up, down) after
    the knee curve with k = threshold * knee + 1e-5 and
    q = clamp(b - threshold + k, 0, 2k)^2 / (4k).
    ``down_0`` has half of this size, floored, and each next level half of the one before, by four
    taps of 1/4, one texel to each side. With lg = log2(height) + radius - 8, there are
    N = clamp(trunc(lg), 1, 16) levels, and the taps of the tent are 0.5 + lg - trunc(lg) texels
    apart. up_k = down_k + tent(up_k+1) and ``bloom`` = tent(up_0): the sum of the levels, not
    their mean. In "rgba8unorm" the images up_k hold means, and the bloom is N times as coarse.

    Source: keijiro/KinoBloom @ 0a04c43fa47d (2017), Assets/Kino/Bloom/Bloom.cs, Bloom.cginc.

    Examples
    --------
    >>> vkbloom.KinoBloom(threshold=1.0, radius=4).composite
    'add'
    """

    method: ClassVar[str] = "kino"
    composites: ClassVar[tuple[Composite, ...]] = ("add",)

    threshold: float | None = _linear(0.8)
    knee: float = number_field("knee", default=0.5)
    intensity: float = number_field("intensity", default=0.8)
    format: BloomFormat | None = "rgba16float"
    radius: float = number_field("radius", default=2.5, range=(1, 7))
    anti_flicker: bool = flag_field("anti_flicker")


@dataclasses.dataclass(frozen=True, kw_only=True)
class FilamentBloom(Settings):
    """Filament's bloom at its low quality, the default one.

    Parameters
    ----------
    resolution : int
        Height of ``down_0`` before it is floored to a multiple of 16, 16 to 2048.
    levels : int
        Number of levels, 1 to 12; at most floor(log2(resolution)) + 1.
    highlight : float
        Brightness towards which bright colours are compressed, 10 to 65504. Used only with a
        threshold.
    threshold : float or None
        Filament's is 1 or off. With a threshold, fireflies are filtered, too.
    composite : {"add"}
    intensity : float
        Filament's strength, 0 to 1.
    **settings
        The other fields of `Settings`; there is no knee.

    See Also
    --------
    presets : "filament".

    Notes
    -----
    The width of ``down_0`` follows from the aspect of the frame, floored to a multiple of 16, at
    most 16384. While
    ``down_0`` is less than half of the frame in width or height, the frame is halved first. All
    these steps are a bilinear sample of the image convolved with (1 2 1)^2 / 16. The first one
    includes the threshold: its four bilinear taps are weighted by 1 / (1 + brightest channel);
    then c = max(0, c - threshold); then c / (1 + brightest channel of c / highlight). Each further
    level has half the size, floored, by 3 x 3 taps 1.761629 texels apart, the outer ones with a
    weight of 7.46602 / 32 along an axis. If a side of the level above is odd, it is reduced by the
    13 taps of `Pyramid`. up_k = down_k + tent(up_k+1) with a tent of one pixel of the larger level;
    ``bloom`` is one bilinear sample of up_0, divided by the number of levels.

    Source: google/filament: bloomDownsample2x.mat @ 9f62dc2f2f53, bloomDownsample9.mat and
    bloomDownsample.mat @ 523a261b1052, bloomUpsample.mat @ 9f62dc2f2f53,
    filament/src/PostProcessManager.cpp @ 003e5005713c, include/filament/Options.h @ 2fac13e154fb.

    Examples
    --------
    >>> vkbloom.FilamentBloom(levels=7).threshold
    1.0
    """

    method: ClassVar[str] = "filament"
    composites: ClassVar[tuple[Composite, ...]] = ("add",)

    threshold: float | None = 1.0
    intensity: float = number_field("intensity", default=0.1, range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    levels: int = number_field("levels", range=(1, 12))
    resolution: int = number_field("resolution", unit="pixel")
    highlight: float = number_field("highlight")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_no_knee(self)


@dataclasses.dataclass(frozen=True, kw_only=True)
class UrpBloom(Settings):
    """Bloom of Unity's Universal Render Pipeline: the Gaussian filter without high quality.

    Parameters
    ----------
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

    See Also
    --------
    HdrpBloom : The bloom of Unity's other pipeline.
    presets : "unity_urp".

    Notes
    -----
    ``down_0`` is one bilinear tap at half of the frame's size, floored. It is clamped; then the
    knee curve is applied, with k = threshold * knee, 4k + 1e-4 and 1e-4. There are
    clamp(floor(log2(longer side of down_0) - 1), 1, iterations) levels. Each next level has half
    the size, floored, by the half-kernel 0.22702703, 0.19459459, 0.12162162, 0.05405405,
    0.01621622. Its horizontal taps are two texels of the level above apart; the vertical taps,
    which follow, one pixel. With s = 0.05 + 0.9 scatter, up_k = lerp(down_k, bilinear(up_k+1), s),
    and ``bloom`` is one bilinear sample of up_0. Dirt and tint are not supported.

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
    composites: ClassVar[tuple[Composite, ...]] = ("add",)

    threshold: float | None = _linear(0.9)
    knee: float = number_field("knee", default=0.5)
    format: BloomFormat | None = "rgba16float"
    scatter: float = number_field("scatter")
    iterations: int = number_field("iterations")
    clamp_max: float = number_field("clamp_max")


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

    See Also
    --------
    UrpBloom : The bloom of Unity's other pipeline.
    presets : "unity_hdrp".

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
    composites: ClassVar[tuple[Composite, ...]] = ("mix",)

    composite: Composite = "mix"
    intensity: float = number_field("intensity", default=2**0.2 - 1, range=(0, 1))
    format: BloomFormat | None = "rgba16float"
    scatter: float = number_field("scatter")
    high_quality_filtering: bool = flag_field("high_quality_filtering")
    anamorphism: float = number_field("anamorphism")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_no_knee(self)
        if self.threshold is not None:
            raise ValueError(
                f"threshold: {self.threshold!r} is not None; the composite that HDRP uses with a "
                "threshold is not supported"
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class UnrealBloom(Settings):
    """three.js' UnrealBloomPass.

    Parameters
    ----------
    radius : float
        0 to 1. The factors of the levels are 1, 0.8, 0.6, 0.4, 0.2 at 0, and 0.2, 0.4, 0.6, 0.8, 1
        at 1.
    smooth_width : float
        Luminance over which the threshold fades in, 0.0001 to 65504.
    node : bool
        Whether to compute the bloom of BloomNode, the successor for WebGPU, which floors sizes.
    threshold : float or None
        Luminance at which the fade begins.
    composite : {"add"}
    intensity : float
        Three times the strength of three.js. With `node` it is the strength itself, so that
        ``intensity=1`` is its default.
    **settings
        The other fields of `Settings`; there is no knee.

    See Also
    --------
    presets : "threejs_unreal".

    Notes
    -----
    ``bright`` is one bilinear tap at half of the frame's size, rounded, times
    smoothstep(threshold, threshold + smooth_width, luminance). There are five levels. ``down_0``
    has the size of ``bright``, each next level half the size of the one before, rounded. Each is
    the image above it (``bright`` for ``down_0``), blurred along x, then along y. The taps are one
    pixel of the level apart. Their weights are 0.39894 exp(-i^2 / (2 sigma^2)) / sigma with
    -R < i < R, R = 6, 10, 14, 18, 22 and sigma = R / 3, not normalized. ``up_0`` is the sum of the
    levels, enlarged bilinearly and multiplied by their factors; ``bloom`` is one bilinear sample
    of it. In "rgba8unorm", up_0 is a third of that.

    With `node`, all halves are floored, but at least 1, and the luminance has the weights of
    Rec. 709 with four digits. Newer versions of BloomNode merge neighbouring taps into one bilinear
    fetch. This differs if a level is read at another size, and is not supported.

    Source: mrdoob/three.js, examples/jsm/postprocessing/UnrealBloomPass.js since pull requests
    #31528 (kernels) and #32517 (factor 3), examples/jsm/shaders/LuminosityHighPassShader.js
    @ 0255e15dd1d4; defaults of examples/jsm/tsl/display/BloomNode.js, since the pass has none
    for radius and threshold.

    Examples
    --------
    >>> vkbloom.UnrealBloom(radius=0.5, threshold=0.8).intensity
    3.0
    """

    method: ClassVar[str] = "unreal"
    composites: ClassVar[tuple[Composite, ...]] = ("add",)

    threshold: float | None = 0.0
    intensity: float = number_field("intensity", default=3.0)
    format: BloomFormat | None = "rgba16float"
    radius: float = number_field("radius", default=0.0, range=(0, 1))
    smooth_width: float = number_field("smooth_width")
    node: bool = flag_field("node")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_no_knee(self)
