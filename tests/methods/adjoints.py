"""Settings whose derivatives tests compare with those of the reference."""

from __future__ import annotations

from typing import Any

import numpy as np

import vkbloom
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    DualKawase,
    FilamentBloom,
    GodotBloom,
    HdrpBloom,
    KinoBloom,
    PygfxBloom,
    Pyramid,
    Separable,
    ThreeBloom,
    UrpBloom,
    reference,
)

#: The bloom buffers of derivatives.
SINGLE: Any = {"format": "rgba32float"}
BEVY = BevyBloom(max_mip_dimension=16)
STREAKS = vkbloom.Streaks(
    angle=10, directions=3, iterations=2, halvings=1, colour_shift=0.3, threshold=0.2
)
KERNEL = np.random.default_rng(1).random((5, 5)) ** 8
CASES: dict[str, Any] = {
    "separable": Separable(),
    "hard": Separable(threshold=0.5, bloom_scale=1.6),
    "knee": Separable(threshold=0.6, knee=0.5, intensity=0.7, exposure=0.5),
    "between texels": Separable(bloom_scale=0.37, blur_scale=1.7, threshold=0.4, knee=0.3),
    "layers": Separable(loops=2, layers=((1.0, 0.5), (2.5, 0.25)), composite="mix", intensity=0.4),
    "direct": Separable(direct=True, texel="x", composite="screen", intensity=0.4),
    "alpha blur": Separable(alpha="blur", threshold=0.4, knee=0.5),
    "alpha max": Separable(alpha="max", tonemap="reinhard", encoding="srgb"),
    "aces": Pyramid(levels=3, tonemap="aces", encoding="gamma22"),
    "exponential": Pyramid(levels=2, tonemap="exponential", encoding="hlg"),
    "khronos": Separable(tonemap="khronos_neutral"),
    "agx": Separable(tonemap="agx"),
    "pq": Separable(encoding="pq"),
    "off": Separable(bloom=False, tonemap="aces"),
    "pyramid": Pyramid(
        levels=4, threshold=0.3, knee=0.5, radius=1.3, level_weights=(0.5, 0.2, 0.2, 0.1)
    ),
    "firefly": Pyramid(levels=2, firefly_filter=True, scale_x=1.5),
    "bevy": BEVY,
    "bevy threshold": BEVY.replace(threshold=0.4, knee=0.5),
    "kino": KinoBloom(radius=7.0, threshold=0.3, knee=0.5),
    "urp": UrpBloom(threshold=0.3, knee=0.5, clamp=1.5, tint=(1.0, 0.3, 0.6)),
    "urp 12": UrpBloom(version="12", high_quality=True, downscale="quarter", threshold=0.3),
    "tints": ThreeBloom(tints=((1, 0.5, 0.2), (1, 1, 1), (2, 1, 1), (0, 1, 1), (1, 1, 0.5))),
    "unreal": ThreeBloom(threshold=0.3, smooth_width=0.4),
    "r187": ThreeBloom(variant="r187", threshold=0.3, smooth_width=0.4),
    "ppv2": vkbloom.PostProcessingBloom(threshold=0.4, color=(1.0, 0.5, 0.2), clamp=1.2),
    "unreal standard": vkbloom.UnrealBloom(threshold=0.3),
    "halation": vkbloom.Halation(pixel_size=30.0),
    "ppv2 fast": vkbloom.PostProcessingBloom(threshold=None, fast=True),
    "pmndrs": vkbloom.PmndrsBloom(threshold=0.3, smoothing=0.4, levels=3, intensity=0.7),
    "babylon": vkbloom.BabylonBloom(threshold=0.3),
    "playcanvas": vkbloom.PlayCanvasBloom(threshold=0.3),
    "kawase": DualKawase(levels=3, offset=1.3),
    "pygfx": PygfxBloom(levels=3, filter_radius=0.2),
    "pygfx karis": PygfxBloom(levels=2, karis_average=True),
    "filament": FilamentBloom(resolution=40, levels=4),
    "filament threshold": FilamentBloom(resolution=16, levels=2, threshold=0.4, highlight=10.0),
    "filament alpha": FilamentBloom(resolution=16, threshold=0.4, alpha="blur"),
    "streaks": Separable(threshold=0.3, knee=0.5, glare=(STREAKS,)),
    "glare alpha": Pyramid(levels=2, alpha="blur", glare=(STREAKS,)),
    # Kernels of even sides, and larger than the image.
    **{
        f"{boundary} {len(kernel)}": vkbloom.Convolution(
            psf=kernel, boundary=boundary, threshold=0.3, knee=0.5
        )
        for boundary in ("zero", "edge", "wrap", "wrap_x")
        for kernel in (np.random.default_rng(1).random(shape) for shape in ((4, 5, 3), (13, 6, 3)))
    },
    "no kernel": vkbloom.Convolution(psf=np.ones((3, 3)), bloom=False),
    # Its groups below each other would be higher than images may be.
    "high": KinoBloom(radius=1.0),
    "psf": vkbloom.Convolution(psf=KERNEL, threshold=0.3),
    **{
        f"prefilter {boundary}": vkbloom.Convolution(
            psf=vkbloom.psf.unreal(KERNEL, prefilter=(0.5, 1.2, 1.5)), boundary=boundary
        )
        for boundary in ("zero", "edge")
    },
    "hdrp": HdrpBloom(anamorphism=0.3),
    "godot": GodotBloom(
        threshold=0.3, threshold_scale=0.4, luminance_cap=1.2, strength=1.3, exposure=0.4
    ),
    "godot screen": GodotBloom(
        level_weights=(0.5, 0, 0.3, 0, 0, 0, 0), composite="screen", intensity=0.7, threshold=None
    ),
    "godot soft": GodotBloom(
        composite="soft_light", tonemap="reinhard", bicubic=False, threshold=None
    ),
    "godot replace": GodotBloom(composite="replace", encoding="srgb", threshold=0.2),
    "godot mix": GodotBloom(composite="mix", intensity=0.4, exposure=0.5, threshold=0.2),
    "darktable": vkbloom.DarktableBloom(threshold=40.0, blur_size=2.0),
    "darktable aces": vkbloom.DarktableBloom(threshold=None, tonemap="aces"),
    "blender": BlenderGlare(threshold=0.4, smoothness=0.3, saturation=1.7, tint=(1, 0.5, 0.2)),
    "blender low": BlenderGlare(
        quality="low", size=1.0, maximum=0.4, threshold=0.3, saturation=0.4
    ),
    "blender streaks": BlenderGlare(type="streaks", threshold=0.3, streaks=3, streaks_angle=20),
    "blender streaks 5.2": BlenderGlare(
        type="streaks", version="5.2", threshold=0.3, quality="medium", streaks=2
    ),
    "blender fog": BlenderGlare(type="fog_glow", threshold=0.3, quality="medium"),
    "blender kernel": BlenderGlare(type="kernel", kernel=KERNEL, threshold=0.3),
    "blender ghosts": BlenderGlare(type="ghosts", threshold=None),
    "blender star": BlenderGlare(type="simple_star", threshold=None),
    "blender cross": BlenderGlare(type="simple_star", threshold=None, diagonal=False),
    "blender beams": BlenderGlare(type="sun_beams", threshold=None),
    "blender jitter": BlenderGlare(type="sun_beams", threshold=None, jitter=0.4),
    # Highlights that are 0 without a slope have no cotangents.
    "blender dark beams": BlenderGlare(type="sun_beams", threshold=1.2, smoothness=0.2),
    "blender dark blocks": BlenderGlare(
        type="sun_beams", threshold=0.8, smoothness=0.0, quality="low", jitter=0.3
    ),
    "halo": Pyramid(levels=1, glare=(vkbloom.Halo(radius=0.4, width=0.3),)),
    "halo aberration": Pyramid(
        levels=1, glare=(vkbloom.Halo(aberration=0.05, halvings=0, threshold=0.2),)
    ),
    "ghosts": Pyramid(
        levels=1, glare=(vkbloom.Ghosts(halvings=0, threshold=0.1, vignette=0.5, falloff=2.0),)
    ),
    "ghosts aberration": Pyramid(
        levels=1,
        glare=(vkbloom.Ghosts(scales=(0.001, 0.5, -0.9, 1.5), halvings=0, aberration=0.05),),
    ),
    "dirt": Pyramid(levels=1, alpha="blur", glare=(STREAKS, vkbloom.Dirt(seed=1))),
}


PARTS = ("glow", "blur_vertical", "bloom", "final")


def pull(
    renderer: Any, image: Any, settings: Any, names: tuple[str, ...] = PARTS, /, **given: Any
) -> Any:
    frames, pullback = vkbloom.vjp(image, settings, **given, renderer=renderer)
    random = np.random.default_rng(5)
    cotangents = {
        name: random.standard_normal(frames[name].shape).astype(np.float32)
        for name in names
        if name in frames
    }
    return pullback, cotangents, reference.vjp(image, settings, **given)[1](cotangents)


def check(found: Any, expected: Any, name: str, share: float = 1e-5) -> None:
    limit = share * max(np.abs(expected[name]).max(), 1e-3)
    assert np.abs(found[name] - expected[name]).max() <= limit, name
