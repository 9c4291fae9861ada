"""The settings and formats with which all paths through the core are tested."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from vkbloom import (
    BabylonBloom,
    BevyBloom,
    BlenderGlare,
    Convolution,
    DarktableBloom,
    DualKawase,
    FilamentBloom,
    GodotBloom,
    Halation,
    HdrpBloom,
    KinoBloom,
    PlayCanvasBloom,
    PmndrsBloom,
    PostProcessingBloom,
    PygfxBloom,
    Pyramid,
    Separable,
    Settings,
    ThreeBloom,
    UnrealBloom,
    UrpBloom,
    gaussian_weights,
    presets,
    psf,
)
from vkbloom._doctor.cases import (
    COMPOSITES,
    ENCODINGS,
    HARD_THRESHOLD,
    METHODS,
    TONEMAPS,
    presets_of_low_levels,
)

__all__ = [
    "COMPOSITES",
    "ENCODINGS",
    "GIVEN",
    "HARD_THRESHOLD",
    "METHODS",
    "OTHERS",
    "TONEMAPS",
    "WHOLE",
    "presets_of_low_levels",
]

NORMALIZED = Separable(weights=gaussian_weights(2.0), blur_strength=1.0)
# A fused pass replaces several of these if only `final` is requested.
WHOLE: dict[str, Settings] = {
    "tutorial": Separable(),
    "threshold": Separable(threshold=0.3, knee=0.5, composite="screen", intensity=0.7),
    # (Without encoding: near black, the curve turns one level of the bloom into many.)
    "hard": Separable(threshold=HARD_THRESHOLD, tonemap="aces"),
    "near": Separable(blur_scale=0.63, composite="mix", intensity=0.4),
    "wide": Separable(weights=gaussian_weights(4.0, 12), blur_strength=1.0, exposure=-1.0),
    # (Dithering makes two levels of a value that differs in its last bit.)
    "dithered": Separable(first_tap=0, blur_strength=0.4, texel="x", dither=True, dither_seed=3),
    "curved-pyramid": Pyramid(levels=4, threshold=0.2, tonemap="reinhard", encoding="gamma22"),
    "small-tent": Pyramid(levels=3, radius=0.6, exposure=0.5),
}
NOISE = np.random.default_rng(5).random((9, 12, 3))
# Every method with its threshold, every formula of alpha and mix, every way to a smaller bloom.
MASK, EMISSION, BOTH = ("mask",), ("emission",), ("mask", "emission")
GIVEN: dict[str, tuple[Settings, tuple[str, ...]]] = {
    "separable-mask": (Separable(threshold=0.3, knee=0.5, composite="mix"), MASK),
    "separable-both": (Separable(threshold=HARD_THRESHOLD), BOTH),
    "pyramid-mask": (Pyramid(levels=3, threshold=0.3, composite="mix"), MASK),
    "pyramid-max": (Pyramid(levels=2, alpha="max", composite="mix", intensity=0.25), EMISSION),
    "separable-half": (Separable(bloom_scale=0.5, alpha="blur"), MASK),
    "separable-layers": (
        Separable(layers=((1.0, 1.0), (2.0, 0.5)), alpha="blur", blur_strength=0.5),
        EMISSION,
    ),
    "separable-direct": (Separable(direct=True, alpha="max"), MASK),
    "separable-loops": (Separable(loops=2, blur_scale=1.7, alpha="blur"), ()),
    "pyramid-alpha": (Pyramid(levels=3, alpha="blur"), MASK),
    "pyramid-firefly-both": (Pyramid(firefly_filter=True, alpha="blur"), BOTH),
    "pyramid-weights": (
        Pyramid(levels=3, level_weights=(0.2, 0.5, 0.4), format="rgba16float", alpha="blur"),
        MASK,
    ),
    "dual-kawase-mask": (DualKawase(levels=3, threshold=HARD_THRESHOLD, alpha="blur"), MASK),
    "kino-mask": (KinoBloom(threshold=0.5, alpha="blur"), MASK),
    "bevy-mask": (BevyBloom(threshold=0.3, max_mip_dimension=32, alpha="blur"), MASK),
    "bevy-emission": (BevyBloom(max_mip_dimension=32), EMISSION),
    "filament-mask": (FilamentBloom(threshold=0.4, resolution=16, alpha="blur"), MASK),
    "filament-both": (FilamentBloom(resolution=48, alpha="max"), BOTH),
    "urp-mask": (UrpBloom(threshold=0.5, clamp=3.0, alpha="blur"), MASK),
    "hdrp-mask": (HdrpBloom(composite="mix", alpha="blur"), MASK),
    "unreal-mask": (ThreeBloom(threshold=0.5, alpha="blur"), MASK),
    "ppv2-mask": (PostProcessingBloom(threshold=0.5, color=(1.0, 0.5, 0.2), alpha="blur"), MASK),
    "pmndrs-mask": (PmndrsBloom(threshold=0.3, alpha="blur"), MASK),
    "babylon-mask": (BabylonBloom(threshold=0.3, alpha="blur"), MASK),
    "unreal-standard-mask": (UnrealBloom(threshold=0.4, alpha="blur"), MASK),
    "halation-mask": (Halation(alpha="blur"), MASK),
    "playcanvas-mask": (PlayCanvasBloom(threshold=0.5, alpha="blur"), MASK),
    "darktable-mask": (DarktableBloom(threshold=60.0, alpha="blur"), MASK),
    "playcanvas-emission": (PlayCanvasBloom(), EMISSION),
    "darktable-emission": (DarktableBloom(blur_size=1.0, format="rgba32float"), EMISSION),
    "godot-mask": (GodotBloom(threshold=0.3, exposure=0.5, composite="mix", alpha="blur"), MASK),
    "godot-emission": (GodotBloom(composite="mix", alpha="max"), EMISSION),
    "blender-mask": (BlenderGlare(threshold=0.5, alpha="blur"), MASK),
    "pygfx-mask": (PygfxBloom(karis_average=True, alpha="blur", composite="mix"), BOTH),
    "convolution-mask": (Convolution(NOISE[:5, :7], alpha="blur"), MASK),
    "convolution-emission": (Convolution(NOISE[:5, :7], alpha="max"), EMISSION),
    "godot-none": (GodotBloom(level_weights=(0,) * 7), ()),
    "godot-last": (GodotBloom(level_weights=(0, 1, 0, 1e-4, 0, 0, 0)), ()),
}
KERNEL = (np.random.default_rng(7).random((7, 4, 3)) ** 4).astype(np.float32)
GODOTS: Any = itertools.product(
    ("screen", "soft_light", "add", "replace", "mix"), ("none", "reinhard", "aces")
)
OTHERS: dict[str, Settings] = {
    "layers-normalized": NORMALIZED.replace(layers=((0.5, 0.4), (1.3, 0.5)), loops=2),
    "loops": Separable(loops=3, blur_scale=1.1),
    "loops-x": NORMALIZED.replace(loops=3, blur_scale=1.1, texel="x"),
    "far": Separable(blur_scale=16.0, blur_strength=0.5),
    "no-centre": Separable(weights=(0.0, 0.5), blur_strength=1.0),
    "negative-weights": Separable(weights=(0.8, -0.2, 0.1)),
    "longest-near": METHODS["longest"].replace(blur_scale=0.4),
    "direct-outline": Separable(direct=True, blur_scale=1.37, texel="x", first_tap=0),
    "fixed-scale": Separable(bloom_size=(40, 30), blur_scale=2.0),
    "fixed-layers": Separable(bloom_size=(40, 30), layers=((1.0, 0.5), (2.0, 0.5))),
    "fixed-wider": Separable(bloom_size=(300, 20)),
    "fixed-direct": Separable(bloom_size=(50, 61), direct=True, texel="x", blur_scale=1.2),
    "kawase-near": DualKawase(levels=2, threshold=0.3, knee=0.5),
    "kawase-far": DualKawase(levels=2, threshold=0.3, offset=3.5),
    **{
        f"level-weights-{i}": Pyramid(levels=4, level_weights=weights, intensity=0.5)
        for i, weights in enumerate(((1, 0.5, 0.25, 2), (0, 0, 1, 0), (0,) * 4))
    },
    # Differences of halves are off by more than a share of themselves.
    "level-weights-negative": Pyramid(
        levels=4, level_weights=(1, -0.5, 0, 0.25), format="rgba32float"
    ),
    "bevy": BevyBloom(max_mip_dimension=32),
    # Bloom::OLD_SCHOOL, SCREEN_BLUR and ANAMORPHIC, of fewer levels
    "bevy-old-school": BevyBloom(
        intensity=0.05, threshold=0.6, knee=0.2, composite="add", max_mip_dimension=64
    ),
    "bevy-screen-blur": BevyBloom(
        intensity=1.0,
        max_mip_dimension=64,
        low_frequency_boost=0.0,
        low_frequency_boost_curvature=0.0,
        high_pass_frequency=1 / 3,
    ),
    "bevy-anamorphic": BevyBloom(scale_x=4.0, max_mip_dimension=64),
    "bevy-few-levels": BevyBloom(max_mip_dimension=5, composite="add"),
    "bevy-scales": BevyBloom(scale_x=0.3, scale_y=2.7, max_mip_dimension=32, threshold=0.3),
    "kino-wide": KinoBloom(radius=7.0),
    "kino-narrow": KinoBloom(radius=1.0, threshold=None),
    "kino-flicker": KinoBloom(radius=4.2, anti_flicker=False, knee=0.0, threshold=1.5),
    "filament": FilamentBloom(resolution=32),
    "filament-one-level": FilamentBloom(threshold=None, levels=1, resolution=64),
    "filament-halved": FilamentBloom(resolution=40, levels=12, highlight=10.0),
    "filament-odd": FilamentBloom(resolution=112, levels=5, threshold=0.25),
    "urp-narrow": UrpBloom(scatter=0.0, threshold=None, iterations=2),
    "urp-wide": UrpBloom(scatter=1.0, clamp=30.0, iterations=8),
    # Taps that are in a window, and some that are too far apart for one.
    "urp-kawase": UrpBloom(filter="kawase"),
    "urp-dual": UrpBloom(filter="dual", scatter=0.9, high_quality=True),
    "urp-quarter": UrpBloom(downscale="quarter", tint=(0.2, 0.9, 0.5), threshold=0.2),
    "urp-12": UrpBloom(version="12", high_quality=True, tint=(1.0, 0.0, 0.0)),
    "hdrp": HdrpBloom(),
    "hdrp-narrow": HdrpBloom(scatter=0.0),
    "hdrp-linear": HdrpBloom(scatter=1.0, high_quality_filtering=False),
    "hdrp-down": HdrpBloom(anamorphism=0.7),
    "hdrp-across": HdrpBloom(anamorphism=-1.0),
    "unreal-wide": ThreeBloom(radius=1.0, threshold=0.85, smooth_width=0.5),
    "unreal-no-threshold": ThreeBloom(radius=0.4, threshold=None, intensity=1.5),
    "r187": ThreeBloom(variant="r187", radius=0.3, threshold=0.2, smooth_width=0.3),
    "tints": ThreeBloom(tints=((1, 1, 1), (0.5, 0.2, 1), (1, 1, 1), (0, 2, 1), (1, 1, 1))),
    "node-small": ThreeBloom(variant="node", resolution_scale=0.3, intensity=1.0),
    "unreal-threshold": UnrealBloom(threshold=-0.7, size_scale=1.0),
    "unreal-one": UnrealBloom(tints=(0.8, 0, 0, 0, 0, 0), size_scale=8.0),
    "halation-wide": Halation(pixel_size=3.0),
    "ppv2-fast": PostProcessingBloom(fast=True, anamorphic_ratio=-0.6, threshold=0.4, diffusion=9),
    "ppv2-wide": PostProcessingBloom(threshold=None, anamorphic_ratio=1.0, clamp=1.5, diffusion=10),
    "pmndrs-one-level": PmndrsBloom(levels=1, threshold=None, composite="add"),
    "pmndrs-screen": PmndrsBloom(levels=3, threshold=0.2, smoothing=0.5, intensity=3.0),
    "babylon-narrow": BabylonBloom(kernel=3, scale=1.0, weight=0.7, threshold=None),
    # (The cube of the lightness makes much of the last bit of a half float.)
    "darktable": DarktableBloom(threshold=40.0, blur_size=2.0, format="rgba32float"),
    "darktable-no-threshold": DarktableBloom(threshold=None, strength=60.0, format="rgba32float"),
    "playcanvas-two": PlayCanvasBloom(blur_level=2, intensity=0.3),
    "node": ThreeBloom(variant="node", intensity=1.0, threshold=0.4),
    **{
        f"godot-{composite}-{tonemap}": GodotBloom(
            composite=composite,
            tonemap=tonemap,
            exposure=0.5,
            intensity=0.8,
            threshold=0.3,
            white=2.0,
            format="rgba32float",
        )
        for composite, tonemap in GODOTS
    },
    "godot-fixed": presets["godot_4_6"].replace(bloom_size=(50, 31)),
    "godot-weights": GodotBloom(level_weights=(0.5,) * 7, format="rgba32float"),
    "godot-linear": GodotBloom(bicubic=False, level_weights=(0.5,) * 7, format="rgba32float"),
    "blender-maximum": BlenderGlare(maximum=4.0),
    "blender-half": BlenderGlare(bloom_scale=0.5, maximum=3.0, format="rgba32float"),
    # Of the sizes of the matrix, 97 has columns that Blender 5.2 reads beside their place.
    "blender-5.2": BlenderGlare(type="streaks", version="5.2", threshold=0.3),
    "pygfx-karis": PygfxBloom(karis_average=True, bloom_scale=0.7),
    "pygfx-narrow": PygfxBloom(filter_radius=0.0, levels=4, format="rgba32float"),
    "pygfx-wide": PygfxBloom(filter_radius=0.2, levels=4, format="rgba32float"),
    "convolution-edge": Convolution(KERNEL, boundary="edge"),
    "convolution-knee": Convolution(
        KERNEL, threshold=0.2, knee=0.5, composite="mix", intensity=0.5
    ),
    "convolution-fixed": Convolution(psf.spencer(), bloom_size=(20, 31)),
}
