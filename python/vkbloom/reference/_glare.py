"""The stages of glare: light that is added to the bloom, computed from the glow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ._image import Storage, storage
from ._pyramid import downsample
from ._sampling import Array, sample
from ._tape import Traced
from ._upsampling import halvings


def stages(source: Array, glare: Sequence[Any], format: str) -> dict[str, Array]:
    """Return the framebuffer of each stage; `format` is that of the bloom buffers."""
    store = storage("rgba32float" if format == "rgba32float" else "rgba16float")
    counts = Counter(stage.stage for stage in glare)
    seen: Counter[str] = Counter()
    images = {}
    for stage in _lights(glare):
        name = stage.stage
        number = f"_{seen[name]}" if counts[name] > 1 else ""
        seen[name] += 1
        image = halvings(source, 1 + stage.halvings, store, downsample)[-1]
        images[name + number] = store(_STAGES[name](image, stage, store))
    return images


def light(bloom: Array, intensity: float, images: Sequence[Array], glare: Sequence[Any]) -> Array:
    """Return intensity * bloom + the images of the stages, each times its own intensity.

    Dirt D of strength s, enlarged bilinearly, multiplies this by s D, or with "lerp" by
    1 - s + s D; alpha by the mean of the channels of D.
    """
    height, width, channels = bloom.shape
    total = intensity * bloom
    for image, stage in zip(images, _lights(glare), strict=True):
        total = total + stage.intensity * sample(image, (width, height))
    for stage in glare:
        if not stage._adds_light:
            dirt = np.atleast_3d(stage.pixels.astype(np.float64))
            dirt = np.broadcast_to(dirt, (*dirt.shape[:2], 3))
            dirt = np.concatenate([dirt, dirt.mean(axis=2, keepdims=True)], axis=2)[..., :channels]
            share = stage.strength * sample(np.ascontiguousarray(dirt), (width, height))
            total = total * (share + (1 - stage.strength if stage.mode == "lerp" else 0))
    return total


def _lights(glare: Sequence[Any]) -> list[Any]:
    """Return the stages that add light: all but dirt."""
    return [stage for stage in glare if stage._adds_light]


def _above(image: Array, threshold: float) -> Array:
    """Return max(0, c - threshold); alpha is multiplied by the factor of the brightest channel."""
    if threshold == 0:
        return image
    above = np.maximum(image - threshold, 0.0)
    if image.shape[2] == 4:
        brightest = image[..., :3].max(axis=2)
        kept = np.maximum(brightest - threshold, 0.0)
        above[..., 3] = image[..., 3] * kept / np.maximum(brightest, 1e-30)
    return above


def shift_image(image: Array, x: float, y: float) -> Array:
    """Return the image shifted by (x, y) texels, bilinearly, with 0 outside of the image."""
    rows, columns = (np.arange(side, dtype=np.float64) for side in image.shape[:2])
    return texels_at(image, columns[np.newaxis] + x, rows[:, np.newaxis] + y)


def _streaks(image: Array, stage: Any, store: Storage) -> Array:
    """Return the mean of the rays.

    Iteration i of a ray adds its taps at multiples of base^i steps, with the weights
    fade^(k base^i) over their sum.
    """
    base, count = stage.base, max(stage.directions, 2)
    total: Array = np.zeros_like(image)
    for ray in range(count):
        angle = np.radians(stage.angle) + 2 * np.pi * ray / count
        ray_image = _above(image, stage.threshold)
        for iteration in range(stage.iterations):
            weights = stage.fade ** (np.arange(base) * float(base**iteration))
            weights /= weights.sum()
            step = stage.length * base**iteration
            less = 1 - stage.colour_shift ** (iteration + 1)
            ray_image = store(
                sum(
                    weight
                    * tap_colours(tap, less, image.shape[2])
                    * shift_image(
                        ray_image, -tap * step * np.cos(angle), tap * step * np.sin(angle)
                    )
                    for tap, weight in enumerate(weights)
                )
            )
        total += ray_image / count
    return total


def tap_colours(tap: int, less: float, channels: int) -> Array:
    """Return the factors of the channels at a tap: in turn, red, blue or green is kept."""
    kept = np.ones(channels)
    if tap > 0:
        kept[:3] = np.arange(3) == (0, 2, 1)[(tap - 1) % 3]
    factors: Array = kept + less * (1 - kept)
    return factors


def places(image: Array) -> tuple[Array, Array]:
    """Return the pixels' offsets from the centre along x and y, as shares of the sides."""
    height, width, _ = image.shape
    x, y = ((np.arange(side) + 0.5) / side - 0.5 for side in (width, height))
    return np.meshgrid(x, y)


def read(image: Array, x: Array, y: Array) -> Array:
    """Return the image at positions as of `places`, bilinearly, with 0 outside of the image."""
    height, width, _ = image.shape
    return texels_at(image, (x + 0.5) * width - 0.5, (y + 0.5) * height - 0.5)


def texels_at(image: Array, column: Array, row: Array) -> Array:
    """Return the image at positions in texels, bilinearly, with 0 outside of the image."""
    # At a texel's centre (with roundings) the derivative is the mean of those of both sides, whose
    # value is the same.
    is_traced = isinstance(column, Traced) or isinstance(row, Traced)
    near = 1e-9
    both = (
        lambda position: np.floor(position + near),
        lambda position: np.ceil(position - near) - 1,
    )
    sides = both if is_traced else (np.floor,)
    readings = [_between(image, column, row, side(column), side(row)) for side in sides]
    mean: Array = sum(readings[1:], readings[0]) / len(sides)
    return mean


def _between(image: Array, column: Array, row: Array, left: Array, top: Array) -> Array:
    """Return the bilinear mean of the texels at left, left + 1 and top, top + 1."""
    height, width, _ = image.shape
    total: Any = 0.0
    for rows, row_share in ((top, top + 1 - row), (top + 1, row - top)):
        for columns, share in ((left, left + 1 - column), (left + 1, column - left)):
            inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
            texels = image[
                rows.clip(0, height - 1).astype(int), columns.clip(0, width - 1).astype(int)
            ]
            total = total + (row_share * share * inside)[..., np.newaxis] * texels
    result: Array = total
    return result


def _read_input(image: Array, stage: Any, x: Array, y: Array) -> Array:
    """Return the input of a ghost or halo: red and blue are shifted, the threshold subtracted."""
    length = np.hypot(x, y)
    moved = stage.aberration / np.where(length > 0, length, np.inf)
    light = read(image, x, y)
    light[..., 0] = read(image, x - moved * x, y - moved * y)[..., 0]
    light[..., 2] = read(image, x + moved * x, y + moved * y)[..., 2]
    above = _above(light, stage.threshold)
    above[..., :3] = np.minimum(above[..., :3], stage.maximum)
    return above


def _ghosts(image: Array, stage: Any, store: Storage) -> Array:
    """Return the sum of the ghosts: the image read at 1/2 + s (p - 1/2)."""
    x, y = places(image)
    total = np.zeros_like(image)
    tints = stage.tints if len(stage.tints) > 1 else [stage.tints[0]] * len(stage.scales)
    for scale, tint in zip(stage.scales, tints, strict=True):
        distance = np.abs(scale) * np.hypot(x, y)
        weight = np.maximum(0, 1 - distance / stage.radius) ** stage.falloff
        factors = np.concatenate([tint, np.sum(tint, axis=0, keepdims=True) / 3])[: image.shape[2]]
        total += weight[..., np.newaxis] * factors * _read_input(image, stage, scale * x, scale * y)
    corner = np.minimum(((2 * x) ** 2 + (2 * y) ** 2) ** 2, 1)
    total *= (1 + stage.vignette * (corner - 1))[..., np.newaxis]
    return total


def _halo(image: Array, stage: Any, store: Storage) -> Array:
    """Return the image shifted by `radius` to the centre, weighted by a ring of that radius."""
    height, width, _ = image.shape
    x, y = places(image)
    across, down = x * width / height, y
    distance = np.hypot(across, down)
    step = stage.radius / np.where(distance > 0, distance, np.inf)
    light = _read_input(image, stage, x - step * x, y - step * y)
    part = np.minimum(np.abs(distance - stage.radius) / stage.width, 1)
    light *= (1 - part * part * (3 - 2 * part))[..., np.newaxis]
    return light


_STAGES: dict[str, Callable[[Array, Any, Storage], Array]] = {
    "streaks": _streaks,
    "ghosts": _ghosts,
    "halo": _halo,
}
