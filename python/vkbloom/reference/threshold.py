"""The threshold: by luminance, or by brightness with a soft knee."""

from __future__ import annotations

import numpy as np

from .sampling import Array, sample

__all__ = ["apply_threshold", "brightest", "luminance", "masked", "soften"]

# Rec. 709 luma coefficients of linear rgb.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def luminance(rgb: Array) -> Array:
    """Return the Rec. 709 luminance 0.2126 r + 0.7152 g + 0.0722 b.

    Parameters
    ----------
    rgb : ndarray of float64, shape (..., 3) or (..., 4)
        Alpha does not count.

    Returns
    -------
    ndarray of float64, shape (..., 1)
    """
    weighted: Array = (rgb[..., :3] * _LUMINANCE).sum(axis=-1, keepdims=True)
    return weighted


def brightest(image: Array) -> Array:
    """Return the largest of the colours' channels, (..., 1); a fourth channel is alpha."""
    largest: Array = image[..., :3].max(axis=-1, keepdims=True)
    return largest


def masked(image: Array, mask: Array | None) -> Array:
    """Return what passed a threshold times the mask, read bilinearly at the image's pixel centres.

    Parameters
    ----------
    image : ndarray of float64, shape (h, w, C)
    mask : ndarray of float64, shape (H, W, 1), or None
    """
    if mask is None:
        return image
    height, width, _ = image.shape
    return image * sample(mask, (width, height))


def apply_threshold(rgb: Array, threshold: float | None, knee: float) -> Array:
    """Keep what is brighter than the threshold.

    Without a knee, a colour stays whole where its luminance is greater than the threshold and
    is 0 elsewhere. With one, with b = max(r, g, b), k = threshold * knee and
    q = clamp(b - threshold + k, 0, 2k)^2 / (4k + 1e-5), the colour is scaled by
    max(q, b - threshold) / max(b, 1e-5): a quadratic that joins 0 at threshold - k to the line
    b - threshold at threshold + k. Both formulas are those of the interface's table of
    settings.

    Parameters
    ----------
    rgb : ndarray of float64, shape (..., 3) or (..., 4)
        Alpha is scaled like the colour.
    threshold : float or None
        In the image's units; None keeps everything.
    knee : float
        Half-width of the soft part, as a fraction of the threshold; 0 for the hard one.

    Returns
    -------
    ndarray of float64, of the same shape
    """
    if threshold is None:
        return rgb
    if knee == 0:
        return np.where(luminance(rgb) > threshold, rgb, 0.0)
    half_width = threshold * knee
    return soften(rgb, threshold, half_width, 4 * half_width + 1e-5, 1e-5)


def soften(rgb: Array, threshold: float, half_width: float, divisor: float, least: float) -> Array:
    """Scale colours by max(q, b - threshold) / max(b, least), b being their brightest channel.

    q = clamp(b - threshold + half_width, 0, 2 half_width)^2 / divisor.

    Parameters
    ----------
    rgb : ndarray of float64, shape (..., C)
    threshold, half_width : float
        Middle and half-width of the soft part, in the image's units.
    divisor, least : float
        About 4 half_width, and the least brightness that is divided by: sources differ there.

    Returns
    -------
    ndarray of float64, shape (..., C)
    """
    brightness = brightest(rgb)
    soft = np.clip(brightness - threshold + half_width, 0, 2 * half_width) ** 2 / divisor
    scale: Array = np.maximum(soft, brightness - threshold) / np.maximum(brightness, least)
    return rgb * scale
