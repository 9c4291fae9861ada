"""Bloom of Unity's Universal Render Pipeline.

From Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.universal:
Shaders/PostProcessing/Bloom.shader @ 00d472fae509,
Runtime/Passes/PostProcess/BloomPostProcessPass.cs @ 13e28e026298.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom._formats import LUMINANCE_7_DIGITS

from . import _dual_kawase as dual_kawase
from ._image import BlurInput
from ._post_processing import linear_light
from ._pyramid import downsample
from ._sampling import Array, box, halve_size, read_rows, sample, size_of
from ._tape import contiguous
from ._threshold import apply_mask, soften, with_alpha
from ._upsampling import Shares, combine, cubic, flat_gain, halvings, linear, mix

if TYPE_CHECKING:
    from vkbloom._methods.unity import UrpBloom

# As in the shader; their sum is 1 - 1e-8.
_WEIGHTS = (0.22702703, 0.19459459, 0.12162162, 0.05405405, 0.01621622)


def passes(source: BlurInput, settings: UrpBloom) -> dict[str, Array]:
    """Return the framebuffers.

    down_0 has half or a quarter of the frame's size: one bilinear tap, or 13 taps, clamped, then
    the soft threshold and the tint. Each further level has half the size of the one above. Nine
    taps two texels apart reduce its width, then nine taps one pixel apart blur its height. up_k
    mixes the level with the smaller one, by the scatter; the bloom is up_0. Both are enlarged
    bilinearly, or by a cubic B-spline. The other filters are of URP 17.
    """
    height, width, channels = source.image.shape
    level = _first_size((width, height), settings)
    reduced = sample(source.image, level)
    if settings.high_quality:
        aspect = height / width if settings.version == "12" else 1.0
        reduced = source.store(downsample(source.image, level, scale=(0.5, 0.5 * aspect)))
    bright = _prefilter(reduced, settings) * with_alpha(_tint(settings), channels)
    first, count = source.store(apply_mask(bright, source.mask)), _level_count(settings, level)
    if settings.filter == "kawase":
        return _kawase(source, settings, first, count)
    if settings.filter == "dual":
        return _dual(source, settings, first, count)

    def shrink(image: Array, size: tuple[int, int]) -> Array:
        horizontal = source.store(_across(image, size, settings))
        return sample(horizontal, size, y_taps=_taps(1.0))

    downs = halvings(first, count, source.store, shrink)
    kernel = _kernel(settings)
    return combine(downs, source, _shares(settings, count), upsample=kernel, last=kernel)


def _across(image: Array, size: tuple[int, int], settings: UrpBloom) -> Array:
    """Blur along x. In URP 17 no tap is beyond the middle of the last two columns."""
    width = image.shape[1]
    lines = sample(image, (width, size[1])).swapaxes(0, 1)
    centres = (np.arange(size[0]) + 0.5) * width / size[0] - 0.5
    last = np.inf if settings.version == "12" else width - 1.5
    total = np.zeros(())
    for offset, weight in _taps(2.0):
        total = total + weight * read_rows(lines, np.minimum(centres + offset, last))
    return contiguous(total.swapaxes(0, 1))


def _kawase(source: BlurInput, settings: UrpBloom, first: Array, count: int) -> dict[str, Array]:
    """Mix the first level with the mean of four taps, again and again."""
    share = 1.0 if settings.scatter >= 0.999 else 0.05 + 0.9 * settings.scatter
    images = {"down_0": first}
    image = first
    for i in range(count):
        distance = 0.5 + (i - 1 if i > count // 2 else i)
        mean = box(image, size_of(image), distance)
        image = source.store((1 - share) * image + share * mean)
        images[f"kawase_{i}"] = image
    return images | {"bloom": source.store.end(_kernel(settings)(image, source.size))}


def _dual(source: BlurInput, settings: UrpBloom, first: Array, count: int) -> dict[str, Array]:
    """Go down and up, and add no level on the way up."""
    downs = halvings(first, count, source.store, partial(dual_kawase.down, offset=1.0))
    enlarge = partial(dual_kawase.up, offset=0.3 + settings.scatter)
    shares = [0.0] * count, [1.0] * count
    return combine(downs, source, shares, upsample=enlarge, last=_kernel(settings))


def _kernel(settings: UrpBloom) -> Callable[[Array, tuple[int, int]], Array]:
    return cubic if settings.high_quality else linear


def _first_size(size: tuple[int, int], settings: UrpBloom) -> tuple[int, int]:
    return halve_size(halve_size(size)) if settings.downscale == "quarter" else halve_size(size)


def _tint(settings: UrpBloom) -> Any:
    """Return the light of the tint, divided by its luminance."""
    colour = [linear_light(channel) for channel in settings.tint]
    grey = sum(map(operator.mul, colour, LUMINANCE_7_DIGITS))
    ones = np.ones(1)
    return np.concatenate([channel / grey * ones if grey else ones for channel in colour])


def gain(settings: UrpBloom, size: tuple[int, int]) -> float | Array:
    """Return the bloom of a flat image of 1: the threshold may change it, the mixes do not."""
    count = _level_count(settings, _first_size(size, settings))
    first = float(_prefilter(np.ones((1, 1, 1)), settings)[0, 0, 0])
    kernel = _WEIGHTS[0] + 2 * sum(_WEIGHTS[1:]) if settings.filter == "gaussian" else 1.0
    first *= flat_gain(_shares(settings, count), [kernel ** (2 * k) for k in range(count)])
    gains = first * _tint(settings)
    return gains if np.ptp(gains) else float(gains[0])


def _level_count(settings: UrpBloom, size: tuple[int, int]) -> int:
    return min(max(math.floor(math.log2(max(size)) - 1), 1), settings.iterations)


def _shares(settings: UrpBloom, count: int) -> Shares:
    return mix(0.05 + (0.95 - 0.05) * settings.scatter, count)


def _prefilter(rgb: Array, settings: UrpBloom) -> Array:
    # The clamp is not applied to alpha.
    kept = np.concatenate([np.minimum(rgb[..., :3], settings.clamp), rgb[..., 3:]], axis=-1)
    kept = soften(kept, settings.threshold, settings.knee, added=1e-4, least=1e-4)
    positive: Array = np.maximum(kept, 0)
    return positive


def _taps(step: float) -> list[tuple[float, float]]:
    return [(i * step, _WEIGHTS[abs(i)]) for i in range(-4, 5)]
