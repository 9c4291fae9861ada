"""Godot's glow.

From godotengine/godot, servers/rendering/renderer_rd/shaders/effects: copy.glsl @ 0a5efd02df51 (the
blur), tonemap.glsl @ 001c8c9c24dc (the gathering and the composite).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._blending import blend
from ._image import BlurInput
from ._sampling import Array, sample
from ._tape import contiguous, join_curves
from ._threshold import apply_mask, brightest, luminance
from ._tone_map import TONE_MAPS
from ._upsampling import cubic, linear

if TYPE_CHECKING:
    from vkbloom._methods.godot import GodotBloom

_WEIGHTS = (0.2024, 0.1790, 0.1240, 0.0672, 0.0285)
_LUMINANCE = np.array([0.299, 0.587, 0.114])
# Levels with a weight up to this one are left out.
_MIN_WEIGHT = 1e-4


def passes(source: BlurInput, settings: GodotBloom) -> dict[str, Array]:
    """Return the framebuffers.

    Level i has the size floor(side / 2) >> i, at least 1. It is the image above it (for level 0
    the frame), read bilinearly at the level's pixel centres, blurred by nine taps one pixel apart,
    and multiplied by the strength. Around the first blur there are more steps: before it, c is
    divided by 1 + L, after it by 1 - L, with L = (0.299, 0.587, 0.114) . c / max(cap, 6), at
    least 0. Strength and exposure follow, then the factor
    max(smoothstep(threshold, threshold + scale, max(c)), bloom) and the cap. The bloom is the
    weighted sum of the levels, enlarged by the cubic B-spline or bilinearly. Levels with weights
    up to 0.0001 are left out of it.
    """
    height, width, channels = source.image.shape
    framebuffers: dict[str, Array] = {}
    image, total = source.image, np.zeros((source.size[1], source.size[0], channels))
    enlarge = cubic if settings.bicubic else linear
    for level, weight in enumerate(_weights(settings)):
        level_size = (max(1, width // 2 >> level), max(1, height // 2 >> level))
        samples = sample(image, level_size)
        if level == 0:
            image = source.store(apply_mask(_first(samples, settings), source.mask))
        else:
            image = source.store(_later(samples, settings))
        framebuffers[f"down_{level}"] = image
        if weight:
            total += weight * enlarge(image, source.size)
    framebuffers["bloom"] = source.store.end(total)
    return framebuffers


def gain(settings: GodotBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1."""
    value, total = np.ones((1, 1, 1)), 0.0
    for level, weight in enumerate(_weights(settings)):
        value = _first(value, settings) if level == 0 else _later(value, settings)
        total += weight * float(value[0, 0, 0])
    return total


def composite(scene: Array, light: Array, settings: GodotBloom, share: float | Array) -> Array:
    """Return scene and light after the tone map, as Godot blends them.

    The light was already exposed before the threshold.
    """
    scene, curve = scene * 2.0**settings.exposure, TONE_MAPS[settings.tonemap]
    if settings.composite == "soft_light":
        soft, toned = np.clip(curve(light), 0, 1), curve(scene)
        dark = ((16 * toned - 12) * toned + 4) * toned
        full = np.where(toned <= 0.25, dark, np.sqrt(np.maximum(toned, 0)))
        lit: Array = join_curves(toned, 1.0, toned + soft * (full - toned), toned)
        return lit
    if settings.composite == "screen":
        light = np.clip(light, 0, settings.white)
        return curve(scene + light - scene * light / settings.white)
    if settings.composite == "replace":
        return curve(light)
    return curve(blend(scene, light, settings.composite, settings.intensity, share))


def slope(scene: Array, settings: GodotBloom) -> Array:
    """Return the largest derivative of the composite by the light.

    The screen is s + g - s g / white, of which s may be any number; so may that of soft light,
    whose g is multiplied by a cubic of the scene where that is dark or negative.
    """
    scene = scene * 2.0**settings.exposure
    slope = np.ones_like(scene)
    if settings.composite == "screen":
        slope = np.abs(1.0 - scene / settings.white)
    elif settings.composite == "soft_light" and settings.tonemap == "none":
        slope = np.abs(((16 * scene - 12) * scene + 3) * scene)
        slope = np.where(scene <= 0.25, slope, 1.0)
    limit: Array = np.maximum(1.0, slope)
    return limit


def _weights(settings: GodotBloom) -> list[float]:
    """Return the weights up to the last one that is not 0, at least one."""
    weights = [w if w > _MIN_WEIGHT else 0.0 for w in settings.level_weights]
    while len(weights) > 1 and weights[-1] == 0:
        weights.pop()
    return weights


def _later(samples: Array, settings: GodotBloom) -> Array:
    return settings.strength * _blur(samples)


def _first(samples: Array, settings: GodotBloom) -> Array:
    blurred = _blur(samples / (1 + _luminance(samples, settings)))
    blurred = blurred / (1 - _luminance(blurred, settings))
    blurred = blurred * settings.strength
    # Exposure and cap are not applied to alpha.
    blurred[..., :3] *= 2.0**settings.exposure
    if settings.threshold is not None:
        above = brightest(blurred) - settings.threshold
        # With a scale of 0, smoothstep is not defined; this is a step.
        t = np.clip(above / max(settings.threshold_scale, 1e-6), 0, 1)
        blurred = blurred * np.maximum(t * t * (3 - 2 * t), settings.glow_bloom)
    blurred[..., :3] = np.minimum(blurred[..., :3], settings.luminance_cap)
    return blurred


def _luminance(rgb: Array, settings: GodotBloom) -> Array:
    grey = luminance(rgb, _LUMINANCE)
    share: Array = np.maximum(grey, 0) / max(settings.luminance_cap, 6)
    return share


def _blur(samples: Array) -> Array:
    """Apply the nine taps along both axes."""
    columns = _blur_rows(samples.swapaxes(0, 1)).swapaxes(0, 1)
    return contiguous(_blur_rows(columns))


def _blur_rows(samples: Array) -> Array:
    """Apply the taps along the first axis.

    The engine clamps samples in pairs: place n reads clamp(2 floor(n / 2), 0, length - 2) plus
    n mod 2. For a length of 1 this clamp is undefined; here all places read the one sample.
    """
    length = samples.shape[0]
    total = np.zeros_like(samples)
    for tap in range(-4, 5):
        row = np.arange(length) + tap
        pair = np.clip(row - row % 2, 0, max(length - 2, 0))
        total += _WEIGHTS[abs(tap)] * samples[np.minimum(pair + row % 2, length - 1)]
    return total
