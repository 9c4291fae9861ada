"""Bloom of the library postprocessing for three.js, with its blur of a mip chain.

From pmndrs/postprocessing @ 69c61a640078 (6.39.0): BloomEffect.js, LuminancePass.js,
MipmapBlurPass.js and their shaders.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import _blending as blending
from ._blending import develop
from ._image import BlurInput
from ._sampling import Array, halve_size, sample, size_of
from ._threshold import apply_mask, luminance, smooth_step
from ._upsampling import combine, flat_gain, linear, mix, tent

if TYPE_CHECKING:
    from vkbloom._methods.pmndrs import PmndrsBloom

# (weight, offsets along both axes) of two grids of taps, in texels of the image that is read. The
# weights are rounded in the source, so that they add up to 1.00004.
_DOWN = ((0.125, (-1, 1)), (0.05556, (-2, 0, 2)))


def passes(source: BlurInput, settings: PmndrsBloom) -> dict[str, Array]:
    """Return the framebuffers.

    "bright" is the frame, times a smooth step of its luminance. Each level has half the size of the
    image above it, rounded, and is the sum of 13 taps; those outside of the image are 0. up_k mixes
    down_k with the tent of up_k+1 by the radius; a single level is mixed with its own tent. The
    bloom is up_0, bilinear.
    """
    bright = source.store(apply_mask(_prefilter(source.image, settings), source.mask))
    image, downs = bright, []
    for _ in range(settings.levels):
        image = source.store(_down(image, halve_size(size_of(image), 1)))
        downs.append(image)
    if settings.levels == 1:
        # The second level is the first one again.
        downs.append(downs[0])
    shares = mix(settings.radius, len(downs))
    framebuffers = combine(downs, source, shares, upsample=tent, last=linear)
    if settings.levels == 1:
        del framebuffers["down_1"]
    return {"bright": bright, **framebuffers}


def gain(settings: PmndrsBloom, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1, far from its borders: the weights of the levels."""
    level = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0])
    downs = []
    for _ in range(settings.levels):
        level *= sum(weight * len(offsets) ** 2 for weight, offsets in _DOWN)
        downs.append(level)
    return flat_gain(mix(settings.radius, len(downs)), downs)


def composite(scene: Array, light: Array, settings: PmndrsBloom, share: float | Array) -> Array:
    """Return scene and light; the library's screen does not clamp them, but their product."""
    if settings.composite == "screen":
        return develop(scene + light - np.minimum(scene * light, 1), settings)
    return blending.composite(scene, light, settings, share)


def _prefilter(rgb: Array, settings: PmndrsBloom) -> Array:
    threshold, smoothing = settings.threshold, settings.smoothing
    if threshold is None or threshold == smoothing == 0:
        return rgb
    return rgb * smooth_step((luminance(rgb) - threshold) / max(smoothing, 1e-4))


def _down(image: Array, size: tuple[int, int]) -> Array:
    """Return the sum of the taps; one whose position is beyond 0..1 is 0, except the centre."""
    total = np.zeros((size[1], size[0], image.shape[2]))
    for weight, offsets in _DOWN:
        for y in offsets:
            rows = _inside(image.shape[0], size[1], y)[:, np.newaxis, np.newaxis]
            for x in offsets:
                columns = _inside(image.shape[1], size[0], x)[:, np.newaxis]
                part = sample(image, size, [(float(x), 1.0)], [(float(y), 1.0)])
                total = total + weight * rows * columns * part
    return total


def _inside(length: int, count: int, offset: int) -> Array:
    """Return 1 for each pixel whose tap is inside of the image, else 0."""
    # (i + 1/2) / count + offset / length, in units of 1 / (2 length count).
    at = (2 * np.arange(count) + 1) * length + 2 * count * offset
    return ((at >= 0) & (at <= 2 * length * count)).astype(np.float64)
