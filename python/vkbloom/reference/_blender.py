"""Blender's Glare node: highlights, bloom, and what all types end with.

Formulas from the compositor of Blender 5.0, source/blender/nodes/composite/nodes/
node_composite_glare.cc (@ f92418fbe034: the same formulas).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ._blender_lights import FACTORS, GAINS, LIGHTS, reads_next
from ._blending import develop
from ._image import BlurInput, Storage, finite, storage
from ._pyramid import GROUPS, downsample
from ._sampling import Array, halve_size, sample, size_of, weighted_mean
from ._tape import value_of
from ._threshold import apply_mask, brightest
from ._upsampling import combine, halvings, linear, tent_of_target

if TYPE_CHECKING:
    from vkbloom._methods.blender import BlenderGlare


def passes(source: BlurInput, settings: BlenderGlare) -> dict[str, Array]:
    """Return the framebuffers: "glow" are the highlights, "bloom" the glare over the intensity.

    The glare is made in the size of the highlights, whose sides are those of the frame, a half or a
    quarter of them, rounded up. It is enlarged bilinearly. Its saturation is multiplied, with a
    result of 0 to 1, then its channels by the tint.
    """
    size = size_of(source.image)
    factor = FACTORS[settings.quality]
    reduced = _means(source.image, factor)
    bright = source.store(apply_mask(_highlights(reduced, settings), source.mask))
    framebuffers = {"glow": bright}
    if factor > 1:
        framebuffers = {"highlights": bright, "glow": source.store(sample(bright, size))}
    # 8 bits and few bits of mantissa hold too little of what spreads over hundreds of pixels.
    exact = source.store.high > 65024
    store = source.store if exact or settings.type == "bloom" else storage("rgba16float")
    images = _TYPES[settings.type](bright, settings, store, size)
    light = _enlarge(images.pop("light"), source.size, settings.version)
    rounding = 1e-6 if settings.type in ("fog_glow", "kernel") else 1e-14
    rgb = np.multiply(_settle(light[..., :3], settings.saturation, rounding), settings.tint)
    alpha = light[..., 3:] * (sum(settings.tint[i] for i in range(3)) / 3)
    bloom = source.store.end(np.concatenate([rgb, alpha], axis=2))
    return {**framebuffers, **images, "bloom": bloom}


def composite(scene: Array, light: Array, settings: BlenderGlare, share: float | Array) -> Array:
    """Return max(0, s) + light, whose derivative at black is the mean of both sides."""
    return develop((scene + np.abs(scene)) / 2 + light, settings)


def _enlarge(light: Array, size: tuple[int, int], version: str) -> Array:
    """Return the light in another size."""
    if version != "5.2":
        return sample(light, size)
    # Blender counts rows from the bottom.
    light = light[::-1]
    for count in size[::-1]:
        length, width, _ = light.shape
        after = light[np.minimum(np.arange(1, length + 1), length - 1)]
        steps = reads_next(length, count)[:, np.newaxis, np.newaxis]
        light = np.where(steps, sample(after, (width, count)), sample(light, (width, count)))
        light = light.swapaxes(0, 1)
    return light[::-1]


def gain(settings: BlenderGlare, size: tuple[int, int]) -> Any:
    """Return the bloom of a flat image of 1, for each channel: in the middle of a large one.

    The saturation of a grey is 0. Streaks and ghosts have colours.
    """
    bright = float(_highlights(np.ones((1, 1, 1)), settings)[0, 0, 0])
    levels = bright * GAINS.get(settings.type, lambda *_: np.ones(3))(settings, size)
    tinted = saturate(levels, settings.saturation) * np.array(settings.tint)
    return float(tinted[0]) if (tinted == tinted[0]).all() else tinted


def saturate(rgb: Array, saturation: float) -> Array:
    """Return colours whose saturation s = (max - min) / max is clamp(saturation s, 0, 1).

    The largest channel does not change. Where it is not above 0, the others become equal to it.
    """
    most = rgb.max(axis=-1, keepdims=True)
    spread = most - rgb.min(axis=-1, keepdims=True)
    # The distance of each channel from the largest one is scaled. Around a grey, distances grow
    # from 0 by the same scale. Around black, opposite changes of two channels grow by at most 1/2.
    around_grey = np.where(most > 0, np.inf, np.where(most < 0, 0.0, 0.5))
    most_scale = np.maximum(most, 0.0) / np.where(spread > 0, spread, 1.0)
    scale = np.minimum(saturation, np.where(spread > 0, most_scale, around_grey))
    result: Array = most - scale * (most - rgb)
    return result


def _settle(rgb: Array, saturation: float, rounding: float) -> Array:
    """Return saturated colours, derived as if channels were equal, or 0, that are but for rounding.

    The roundings of a convolution are those of the single floats of renderers, so that the kinks
    are at the same colours.
    """
    values = value_of(rgb)
    if values is rgb:
        return saturate(rgb, saturation)
    near = np.where(np.abs(values) <= rounding, 0.0, values)
    for extreme in (near.max(axis=-1, keepdims=True), near.min(axis=-1, keepdims=True)):
        least = rounding * (1 + 10 * np.abs(extreme))
        near = np.where(np.abs(near - extreme) <= least, extreme, near)
    result: Array = saturate(rgb + (near - values), saturation)
    result = result + (saturate(values, value_of(saturation)) - value_of(result))
    return result


def _means(image: Array, factor: int) -> Array:
    """Return the means of factor x factor pixels, rows from below, with the last ones repeated."""
    for is_first in (True, False):
        length = len(image)
        indices = np.minimum(np.arange(-(-length // factor) * factor), length - 1)
        taps = image[(length - 1 - indices)[::-1] if is_first else indices]
        parts = [taps[i::factor] for i in range(factor)]
        image = (sum(parts[1:], parts[0]) / factor).swapaxes(0, 1)
    return image


def _bloom(
    bright: Array, settings: BlenderGlare, store: Storage, size: tuple[int, int]
) -> dict[str, Array]:
    """Return the levels, and their sum over their number.

    There are n = max(1, floor(log2(size * shorter side))) levels, of which the highlights are the
    first. Each next level has half the size, by 13 taps. In the first such step, the taps within
    each of their groups of four are weighted by 1 / (1 + brightest channel).
    up_k = down_k + tent(up_k+1) with a tent of one pixel of the larger level.
    """
    size = size_of(bright)
    count = max(1, math.floor(math.log2(max(1.0, min(size) * settings.size))))
    downs = [bright]
    if count > 1:
        second = store(_weighted_taps(bright, halve_size(size)))
        downs += halvings(second, count - 1, store, downsample)
    given, up = BlurInput(bright, size, store), tent_of_target
    levels = combine(
        downs, given, upsample=up, last=linear, gain=1 / count, end=lambda image: image
    )
    del levels["down_0"]
    return {**levels, "light": levels.pop("bloom")}


_TYPES: dict[str, Any] = {"bloom": _bloom, **LIGHTS}


def _highlights(rgb: Array, settings: BlenderGlare) -> Array:
    """Scale colours to the part of their brightness that is above the threshold."""
    if settings.threshold is None:
        return rgb
    low = settings.threshold
    high = math.inf if settings.maximum is None else low + settings.maximum
    value = brightest(rgb)
    # The soft parts must not extend below 0 or beyond the other end.
    width = np.minimum(settings.smoothness, high - low)
    at_low, at_high = np.minimum(width, low), np.minimum(width, high)
    kept = _smooth_extreme(1, value, low, at_low)
    if high < math.inf:
        kept = _smooth_extreme(-1, kept, high, at_high)
    scale = (kept - low) / np.where(value > 0, value, 1)
    return np.where(value > 0, rgb * scale, 0)


def _smooth_extreme(sign: int, values: Array, end: float, width: float) -> Array:
    """Return max(value, end) + h^2 width / 4 with h = max(1 - |value - end| / width, 0).

    With a sign of -1, the minimum and a difference. The quadratic smooth minimum of Inigo Quilez,
    "Smooth minimum". Where h is above 0, this is a parabola, which has no kink at the end.
    """
    extreme: Array = (np.maximum if sign > 0 else np.minimum)(values, end)
    if width > 0:
        beyond = values - end
        parabola = (values + end) / 2 + sign * width / 4 + sign * beyond * beyond / (4 * width)
        extreme = np.where(np.abs(beyond) < width, parabola, extreme)
    return extreme


def _weighted_taps(image: Array, size: tuple[int, int]) -> Array:
    """Return the 13 taps of half the size; 0 where negative weights make it undefined."""
    result: Any = 0.0
    for share, columns, rows in GROUPS:
        taps = [sample(image, size, [(x, 1.0)], [(y, 1.0)]) for y in rows for x in columns]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = weighted_mean((1 / (1 + brightest(tap)), tap) for tap in taps)
        result = result + share * mean
    return finite(result)
