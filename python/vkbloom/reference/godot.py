"""Godot's glow.

From godotengine/godot, servers/rendering/renderer_rd/shaders/effects: copy.glsl @ 0a5efd02df51 (the
blur), tonemap.glsl @ 001c8c9c24dc (the gathering).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from .image import Storage
from .sampling import Array, sample
from .threshold import brightest, masked
from .upsampling import cubic, linear

__all__ = ["gain", "passes"]

_WEIGHTS = (0.2024, 0.1790, 0.1240, 0.0672, 0.0285)
_LUMINANCE = np.array([0.299, 0.587, 0.114])
# Weights up to this one count as none.
_LEAST_WEIGHT = 1e-4


class GodotSettings(Protocol):
    """What this blur reads of `vkbloom.GodotBloom`."""

    @property
    def threshold(self) -> float | None: ...
    @property
    def threshold_scale(self) -> float: ...
    @property
    def luminance_cap(self) -> float: ...
    @property
    def glow_bloom(self) -> float: ...
    @property
    def strength(self) -> float: ...
    @property
    def level_weights(self) -> Sequence[float]: ...
    @property
    def bicubic(self) -> bool: ...
    @property
    def exposure(self) -> float: ...


def passes(
    glow: Array,
    settings: GodotSettings,
    size: tuple[int, int],
    store: Storage,
    mask: Array | None = None,
) -> dict[str, Array]:
    """Return the framebuffers.

    Level i has the size floor(side / 2) >> i, never under 1. It is the image above it, the first
    one the frame, read bilinearly at the level's pixel centres, then blurred by nine taps one pixel
    apart, times the strength. Before the first blur c is divided by 1 + L, after it by 1 - L, with
    L = (0.299, 0.587, 0.114) . c / max(cap, 6), 0 at least; then follow strength, exposure, the
    threshold's factor max(smoothstep(threshold, threshold + scale, max(c)), bloom) and the cap. The
    bloom is the sum of the levels, enlarged by the cubic B-spline or bilinearly, times their
    weights; weights up to 0.0001 count as 0.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1, 3 or, with alpha, 4 channels.
    settings : vkbloom.GodotBloom
    size : (int, int)
        Width and height of the bloom.
    store : Storage
        What storing in a bloom buffer does to the values.
    mask : ndarray of float64, shape (h, w, 1), optional
        Multiplies down_0 after the threshold.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", N - 1 being the last level that has a weight, and "bloom",
        (height, width, C).
    """
    height, width, channels = glow.shape
    framebuffers: dict[str, Array] = {}
    image, total = glow, np.zeros((size[1], size[0], channels))
    enlarge = cubic if settings.bicubic else linear
    for level, weight in enumerate(_weights(settings)):
        level_size = (max(1, width // 2 >> level), max(1, height // 2 >> level))
        samples = sample(image, level_size)
        first = level == 0
        image = masked(_first(samples, settings), mask) if first else _later(samples, settings)
        image = store(image)
        framebuffers[f"down_{level}"] = image
        total += weight * enlarge(image, size)
    framebuffers["bloom"] = store.end(total)
    return framebuffers


def gain(settings: GodotSettings) -> float:
    """Return what a flat image of 1 becomes."""
    value, total = np.ones((1, 1, 1)), 0.0
    for level, weight in enumerate(_weights(settings)):
        value = _first(value, settings) if level == 0 else _later(value, settings)
        total += weight * float(value[0, 0, 0])
    return total


def _weights(settings: GodotSettings) -> list[float]:
    """Return the weights up to the last one that counts, one at least."""
    weights = [w if w > _LEAST_WEIGHT else 0.0 for w in settings.level_weights]
    while len(weights) > 1 and weights[-1] == 0:
        weights.pop()
    return weights


def _later(samples: Array, settings: GodotSettings) -> Array:
    return settings.strength * _blur(samples)


def _first(samples: Array, settings: GodotSettings) -> Array:
    blurred = _blur(samples / (1 + _luminance(samples, settings)))
    blurred = blurred / (1 - _luminance(blurred, settings))
    blurred = blurred * settings.strength
    # Neither exposure nor cap is alpha's.
    blurred[..., :3] *= 2.0**settings.exposure
    if settings.threshold is not None:
        # A step where the scale is 0, which smoothstep leaves undefined.
        t = np.clip(
            (brightest(blurred) - settings.threshold) / max(settings.threshold_scale, 1e-6), 0, 1
        )
        blurred = blurred * np.maximum(t * t * (3 - 2 * t), settings.glow_bloom)
    blurred[..., :3] = np.minimum(blurred[..., :3], settings.luminance_cap)
    return blurred


def _luminance(rgb: Array, settings: GodotSettings) -> Array:
    grey = rgb if rgb.shape[2] == 1 else (rgb[..., :3] * _LUMINANCE).sum(axis=-1, keepdims=True)
    share: Array = np.maximum(grey, 0) / max(settings.luminance_cap, 6)
    return share


def _blur(samples: Array) -> Array:
    """Apply the nine taps along both axes."""
    columns = _blur_rows(samples.swapaxes(0, 1)).swapaxes(0, 1)
    return np.ascontiguousarray(_blur_rows(columns))


def _blur_rows(samples: Array) -> Array:
    """Apply the taps along the first axis.

    Pairs of samples are clamped together: place n reads clamp(2 floor(n / 2), 0, length - 2) plus
    n mod 2. With a length of 1, for which the engine's clamp is undefined, all read the one sample.
    """
    length = samples.shape[0]
    total = np.zeros_like(samples)
    for tap in range(-4, 5):
        place = np.arange(length) + tap
        pair = np.clip(place - place % 2, 0, max(length - 2, 0))
        total += _WEIGHTS[abs(tap)] * samples[np.minimum(pair + place % 2, length - 1)]
    return total
