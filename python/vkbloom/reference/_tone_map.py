"""Tone maps and encodings of rgb."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ._sampling import Array
from ._tape import join_curves


def _reinhard(rgb: Array) -> Array:
    """Return c / (c + 1) (Reinhard et al., "Photographic Tone Reproduction", 2002)."""
    with np.errstate(divide="ignore"):
        return rgb / (rgb + 1)


def _aces(rgb: Array) -> Array:
    """Return the filmic fit c (2.51 c + 0.03) / (c (2.43 c + 0.59) + 0.14), clamped to 0..1.

    From Narkowicz, "ACES Filmic Tone Mapping Curve", 2015.
    """
    return np.clip(rgb * (2.51 * rgb + 0.03) / (rgb * (2.43 * rgb + 0.59) + 0.14), 0, 1)


def _exponential(rgb: Array) -> Array:
    """Return 1 - exp(-c)."""
    with np.errstate(over="ignore"):
        return -np.expm1(-rgb)


def _khronos_neutral(rgb: Array) -> Array:
    """Apply Khronos PBR Neutral, from its specification.

    Source: github.com/KhronosGroup/ToneMapping, PBR_Neutral/README.md, section "PBR Neutral
    Specification", with its symbols F90, K_s, K_d, f, p, p_n and g. Input and output are linear.
    """
    fresnel, start, desaturation = 0.04, 0.8 - 0.04, 0.15
    least = rgb.min(axis=-1, keepdims=True)
    toe = np.where(least <= 2 * fresnel, least - least**2 / (4 * fresnel), fresnel)
    colour = rgb - toe
    peak = colour.max(axis=-1, keepdims=True)
    # Only pixels above the start are compressed. The others get a divisor that is not 0.
    compressed = peak > start
    peak = np.where(compressed, peak, 1.0)
    new_peak = 1 - (1 - start) ** 2 / (peak + 1 - 2 * start)
    kept = 1 / (desaturation * (peak - new_peak) + 1)
    return np.where(compressed, colour * (new_peak / peak) * kept + new_peak * (1 - kept), colour)


# Matrices of three.js, release 185, src/renderers/shaders/ShaderChunk/
# tonemapping_pars_fragment.glsl.js, written by rows here. Rec. 2020 <-> sRGB from Report ITU-R
# BT.2407; inset and outset from Blender's AgX.
_SRGB_TO_REC2020 = np.array(
    [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0113], [0.0164, 0.0880, 0.8956]]
)
_REC2020_TO_SRGB = np.array(
    [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]
)
_AGX_INSET = np.array(
    [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ]
)
_AGX_OUTSET = np.array(
    [
        [1.1271005818144368, -0.11060664309660323, -0.016493938717834573],
        [-0.1413297634984383, 1.157823702216272, -0.016493938717834257],
        [-0.14132976349843826, -0.11060664309660294, 1.2519364065950405],
    ]
)
# The range of the logarithm: 10 stops below and 6.5 above a middle grey of 0.18.
_AGX_MIN_EV, _AGX_MAX_EV = -12.47393, 4.026069
# Fit of the default contrast curve, highest power first.
_AGX_CONTRAST = (15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232)


def _agx(rgb: Array) -> Array:
    """Apply AgX with its default look, as in three.js (release 185).

    Linear sRGB -> linear Rec. 2020 -> inset -> log2 between two exposures as 0..1 -> contrast
    polynomial -> outset -> power 2.2, which removes the curve's display encoding -> linear sRGB,
    clamped to 0..1. Input and output are linear, so an encoding has to follow.
    """
    colour = np.maximum(rgb @ (_AGX_INSET @ _SRGB_TO_REC2020).T, 1e-10)
    stops = (np.log2(colour) - _AGX_MIN_EV) / (_AGX_MAX_EV - _AGX_MIN_EV)
    contrast = np.polyval(_AGX_CONTRAST, np.clip(stops, 0, 1))
    linear = np.maximum(contrast @ _AGX_OUTSET.T, 0) ** 2.2
    srgb: Array = np.clip(linear @ _REC2020_TO_SRGB.T, 0, 1)
    return srgb


def _gamma22(rgb: Array) -> Array:
    """Return c^(1 / 2.2), negative values as 0."""
    return np.maximum(rgb, 0.0) ** (1 / 2.2)


def _srgb(rgb: Array) -> Array:
    """Apply the piecewise curve of IEC 61966-2-1, negative values as 0."""
    positive = np.maximum(rgb, 0.0)
    bright = 1.055 * positive ** (1 / 2.4) - 0.055
    encoded: Array = join_curves(positive, 0.0031308, 12.92 * positive, bright)
    return encoded


def _pq(rgb: Array, reference_white: float) -> Array:
    """Apply the inverse EOTF of Rec. ITU-R BT.2100-3, table 4, to luminances up to 10000 cd/m2."""
    m1, m2 = 2610 / 16384, 2523 / 4096 * 128
    c1, c2, c3 = 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32
    power = np.clip(rgb * reference_white / 10000, 0, 1) ** m1
    signal: Array = ((c1 + c2 * power) / (1 + c3 * power)) ** m2
    return signal


def _hlg(rgb: Array) -> Array:
    """Apply the OETF of Rec. ITU-R BT.2100-3, table 5; a value of 1 gives the signal 0.75."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = np.clip(0.26496 * rgb, 0, 1)
    bright = a * np.log(12 * np.maximum(scene, 1 / 12) - b) + c
    return np.where(scene <= 1 / 12, np.sqrt(3 * scene), bright)


# By name in the settings. Each takes and returns finite rgb, (..., 3), of float64. The curves are
# defined for values of at least 0; for negative values the formulas are used unchanged.
TONE_MAPS: Mapping[str, Callable[[Array], Array]] = {
    "none": lambda rgb: rgb,
    "reinhard": _reinhard,
    "aces": _aces,
    "exponential": _exponential,
    "khronos_neutral": _khronos_neutral,
    "agx": _agx,
}
# With the luminance of a value of 1, which only "pq" reads.
ENCODINGS: Mapping[str, Callable[[Array, float], Array]] = {
    "none": lambda rgb, _: rgb,
    "gamma22": lambda rgb, _: _gamma22(rgb),
    "srgb": lambda rgb, _: _srgb(rgb),
    "pq": _pq,
    "hlg": lambda rgb, _: _hlg(rgb),
}
