"""The threshold: by luminance, or by brightness with a soft knee."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vkbloom._formats import LUMINANCE

from ._sampling import Array, sample, size_of
from ._tape import join_curves

# Rec. 709 luma coefficients of linear rgb.
_LUMINANCE = np.array(LUMINANCE)


def luminance(rgb: Array, coefficients: Array = _LUMINANCE) -> Array:
    """Return the luminance, by default that of Rec. 709: 0.2126 r + 0.7152 g + 0.0722 b.

    - `rgb`: ndarray of float64, shape (..., 3), (..., 4) or (..., 1); A fourth channel is alpha,
      which is ignored. A single channel is its own luminance.
    - `coefficients`: ndarray of float64, shape (3,); Sources differ in the last digits.
    """
    if rgb.shape[-1] == 1:
        return rgb
    weighted: Array = (rgb[..., :3] * coefficients).sum(axis=-1, keepdims=True)
    return weighted


def brightest(image: Array) -> Array:
    """Return the largest colour channel, (..., 1); a fourth channel is alpha."""
    largest: Array = image[..., :3].max(axis=-1, keepdims=True)
    return largest


def apply_mask(image: Array, mask: Array | None) -> Array:
    """Return the image times the mask, which is read bilinearly at the image's pixel centres."""
    if mask is None:
        return image
    return image * sample(mask, size_of(image))


def firefly_weight(brightness: Array) -> Array:
    """Return 1 / (1 + brightness), with negative brightness as 0 (Karis, 2013)."""
    weight: Array = 1 / (1 + np.maximum(brightness, 0.0))
    return weight


def smooth_step(share: Array) -> Array:
    """Return x^2 (3 - 2 x) of a share x, clamped to 0..1."""
    x = np.clip(share, 0, 1)
    step: Array = x * x * (3 - 2 * x)
    return step


def with_alpha(colour: Sequence[float], channels: int) -> Array:
    """Return the factors of an image's channels: of rgb the colour, of a fourth channel 1."""
    factors: Array = np.concatenate([colour, np.ones(1)])[:channels]
    return factors


def apply_threshold(rgb: Array, threshold: float | None, knee: float) -> Array:
    """Keep colours brighter than the threshold.

    Without a knee, a colour does not change if its luminance is greater than the threshold, and
    becomes 0 otherwise. With a knee, the colour is scaled by max(q, b - threshold) / max(b, 1e-5)
    with b = max(r, g, b), k = threshold * knee and
    q = clamp(b - threshold + k, 0, 2k)^2 / (4k + 1e-5). This is a quadratic from 0 at
    threshold - k to the line b - threshold at threshold + k. Both formulas are documented with
    `vkbloom.Settings`.
    """
    if threshold is None or threshold < 0:
        return rgb
    if knee == 0:
        return np.where(luminance(rgb) > threshold, rgb, 0.0)
    return soften(rgb, threshold, knee, added=1e-5, least=1e-5)


def soften(
    rgb: Array,
    threshold: float | None,
    knee: float,
    *,
    wider: float = 0.0,
    added: float = 0.0,
    least: float,
) -> Array:
    """Scale colours by max(q, b - threshold) / max(b, least); None: they stay as they are.

    b is the brightest channel, k = threshold * knee + wider, and
    q = clamp(b - threshold + k, 0, 2 k)^2 / (4 k + added). Engines differ in the last three.
    """
    if threshold is None:
        return rgb
    brightness, half_width = brightest(rgb), threshold * knee + wider
    above = brightness - threshold
    soft = np.clip(above + half_width, 0, 2 * half_width) ** 2 / (4 * half_width + added)
    scale: Array = join_curves(above - soft, 0.0, soft, above) / np.maximum(brightness, least)
    return rgb * scale
