"""The types of Blender's Glare node but its bloom: from highlights to light of the same size.

Formulas from the compositor of Blender 5.0, source/blender/nodes/composite/nodes/
node_composite_glare.cc (@ f92418fbe034: the same formulas). Blender counts rows from the bottom.
"""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ._convolution import convolve
from ._glare import places, read, shift_image, tap_colours, texels_at
from ._image import Storage
from ._sampling import Array
from ._tape import value_of

if TYPE_CHECKING:
    from vkbloom._methods.blender import BlenderGlare

#: What the sides of the highlights are divided by, for each quality.
FACTORS: Final = {"high": 1, "medium": 2, "low": 4}

Images = dict[str, Array]


def reads_next(size: int, count: int, offset: Any = 0) -> Array:
    """Return in which of `count` pixels Blender 5.2 reads the texel after the one at their place.

    It finds both texels of a pixel by themselves, at u and at u + 1 in single floats. Where u is
    just below 0 or a power of two, by rounding only, u + 1 is rounded to the integer after the next
    one.
    """
    single = np.float32
    shares = (np.arange(count, dtype=single) + single(0.5)) / single(count) + single(offset)
    position = shares * single(size) - single(0.5)
    is_next: Array = np.floor(position + single(1)) > np.floor(position) + single(1)
    return is_next


def _tap(light: Array, version: str, angle: float, distance: float, tap: int) -> Array:
    """Return the light at a tap of a streak: at `tap` times a distance along an angle."""
    x, y = tap * distance * np.cos(angle), tap * distance * np.sin(angle)
    if version != "5.2":
        return shift_image(light, x, -y)
    height, width, _ = light.shape
    single = np.float32(value_of(angle))
    direction = np.array([np.cos(single), np.sin(single)])
    steps = direction * np.float32(distance) / np.array([width, height], np.float32)
    steps *= np.float32(tap)
    columns = np.arange(width) + x + reads_next(width, width, steps[0])
    rows = np.arange(height) + y + reads_next(height, height, steps[1])
    return texels_at(light[::-1], columns[np.newaxis], rows[:, np.newaxis])[::-1]


def _streaks(bright: Array, settings: BlenderGlare, store: Storage, size: Any) -> Images:
    """Return the sum of the rays.

    Iteration i is half of the sum of four taps, 4^i pixels apart, with the weights f^k for
    f = fade^(4^i). The sum of the rays is divided by 6 - iterations.
    """
    total: Any = 0.0
    for ray in range(settings.streaks):
        angle = np.radians(settings.streaks_angle) + 2 * math.pi * ray / settings.streaks
        light = bright
        for i in range(settings.iterations):
            step = 4.0**i
            kept = 1 - settings.color_modulation ** (i + 1)
            taps = [
                settings.fade ** (step * tap)
                * tap_colours(tap, kept, bright.shape[2])
                * _tap(light, settings.version, angle, step, tap)
                for tap in range(4)
            ]
            light = store(sum(taps[1:], taps[0]) / 2)
        total = store(total + light / (6 - settings.iterations))
    return {"light": total}


def _streaks_gain(settings: BlenderGlare, size: Any) -> Array:
    value = np.ones(3)
    for i in range(settings.iterations):
        kept = 1 - settings.color_modulation ** (i + 1)
        weights = [settings.fade ** (4.0**i * tap) * tap_colours(tap, kept, 3) for tap in range(4)]
        value = value * sum(weights) / 2
    return value * settings.streaks / (6 - settings.iterations)


def _gaussian(image: Array, radius: float) -> Array:
    """Blur by a Gaussian whose standard deviation is a third of its radius, edges repeated."""
    count = math.ceil(radius)
    offsets = np.arange(-count, count + 1)
    weights = np.exp(-0.5 * (3 * offsets / radius) ** 2)
    weights /= weights.sum()
    for _ in range(2):
        at = np.arange(len(image))
        moved = [image[np.clip(at + offset, 0, len(image) - 1)] for offset in offsets]
        image = sum(map(operator.mul, weights, moved)).swapaxes(0, 1)
    return image


def _scale(image: Array, scale: float) -> Array:
    """Return the image scaled about its centre, falling to 0 at half a side from it."""
    x, y = places(image)
    left = np.maximum(0.0, 1 - 2 * abs(scale) * np.hypot(x, y))
    return left[..., np.newaxis] * read(image, scale * x, scale * y)


def _ghost_scales(iterations: int, iteration: int) -> list[float]:
    offset = 0.5 if iterations % 2 else 0.0
    scales = [2.1 * (1 - (4 * iteration + k + offset) / (4 * iterations)) for k in range(4)]
    return [-0.99 / scale if k % 2 else scale for k, scale in enumerate(scales)]


def _ghost_tint(modulation: float, ghost: int, channels: int) -> Array:
    """Return the factors of a ghost's channels; that of alpha is their mean."""
    tint = tap_colours(ghost, 1 - modulation, 3) / 4
    return np.concatenate([tint, *[tint.sum(axis=0, keepdims=True) / 3] * (channels - 3)])


def _ghosts(bright: Array, settings: BlenderGlare, store: Storage, size: Any) -> Images:
    """Return the ghosts of two blurs; each iteration adds four ghosts of the sum so far."""
    radius = 16 / FACTORS[settings.quality]
    small = store(_scale(store(_gaussian(bright, radius)), 2.13))
    light = store(small + _scale(store(_gaussian(bright, 2 * radius)), -0.97))
    total: Any = 0.0
    for i in range(1, settings.iterations):
        for ghost, scale in enumerate(_ghost_scales(settings.iterations, i)):
            tint = _ghost_tint(settings.color_modulation, ghost, bright.shape[2])
            total = total + tint * _scale(light, scale)
        light = total = store(total)
    return {"light": total}


def _ghosts_gain(settings: BlenderGlare, size: Any) -> Array:
    """Return the value at the centre, where nothing has fallen yet."""
    added: Any = sum(_ghost_tint(settings.color_modulation, ghost, 3) for ghost in range(4))
    value: Array = 2 * added * (1 + added) ** (settings.iterations - 2)
    return value


def _convolve(
    bright: Array, settings: BlenderGlare, store: Storage, size: tuple[int, int]
) -> Images:
    """Return the convolution with the kernel, a fourth channel with the mean of its channels."""
    kernel = settings.kernel_pixels(size)
    mean = kernel.mean(axis=2, keepdims=True)
    used = np.concatenate([kernel, *[mean] * (bright.shape[2] - 3)], axis=2)
    return {"kernel": kernel, "light": store(convolve(bright, used, "zero"))}


def _recurse(lines: Array, inside: Array, settings: BlenderGlare, store: Storage) -> Array:
    """Filter along the first axis, forwards and backwards, with results of earlier pixels.

    `inside` is 1 inside of the image, and 0 where a line has no pixel.
    """
    count, fade = len(lines), settings.fade
    nothing = 0 * lines[0]
    values = [lines[at] for at in range(count)]
    for step in range(1, settings.iterations):
        for order in (range(count), range(count - 1, -1, -1)):
            for at in order:
                ends = [
                    values[end] if 0 <= end < count else nothing for end in (at - step, at + step)
                ]
                mixed = (1 - fade) * values[at] + fade * (ends[0] + ends[1]) / 2
                values[at] = inside[at] * store(mixed)
    return np.concatenate([value[np.newaxis] for value in values])


def _simple_star(bright: Array, settings: BlenderGlare, store: Storage, size: Any) -> Images:
    """Return the sum of both directions. Lines start on the left or at the bottom.

    A diagonal is a column of the image whose rows are shifted.
    """
    height, width, _ = bright.shape
    upwards = bright[::-1]
    if not settings.diagonal:
        unit = np.ones((max(height, width), 1, 1))
        across = _recurse(upwards.swapaxes(0, 1), unit, settings, store).swapaxes(0, 1)
        return {"light": store(_recurse(upwards, unit, settings, store) + across)[::-1]}
    total: Any = 0.0
    rows = np.arange(height)[:, np.newaxis]
    for shift in (height - 1 - rows, rows):
        column = np.arange(width + height - 1) - shift
        inside = ((column >= 0) & (column < width)).astype(np.float64)[..., np.newaxis]
        lines = inside * upwards[rows, np.clip(column, 0, width - 1)]
        filtered = _recurse(lines, inside, settings, store)
        total = total + filtered[rows, np.arange(width) + shift]
    return {"light": store(total)[::-1]}


def _hash(x: Any, y: Any) -> Array:
    """Return numbers of 0 to 1 from pairs of integers: the end of Bob Jenkins' lookup3."""
    start = np.uint32(0xDEADBEEF + (2 << 2) + 13)
    a, b = start + x.astype(np.uint32), start + y.astype(np.uint32)
    c = np.full(a.shape, start)
    parts = [a, b, c]

    def rotate(value: Any, count: int) -> Any:
        return (value << np.uint32(count)) | (value >> np.uint32(32 - count))

    for step, count in enumerate((14, 11, 25, 16, 4, 14, 24)):
        # c from b, a from c, b from a, and again.
        changed, other = (step + 2) % 3, (step + 1) % 3
        parts[changed] = (parts[changed] ^ parts[other]) - rotate(parts[other], count)
    numbers: Array = parts[2].astype(np.float64) / 0xFFFFFFFF
    return numbers


def _sun_beams(bright: Array, settings: BlenderGlare, store: Storage, size: Any) -> Images:
    """Return the weighted mean of the pixels between each pixel and the sun."""
    height, width, _ = bright.shape
    # The diagonal is an integer, too.
    most = int(settings.size * int(math.hypot(width, height)))
    if most == 0:
        return {"light": bright}
    upwards, jitter = bright[::-1], settings.jitter
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    sun_x, sun_y = settings.sun_position
    distance = np.maximum(1.0, np.hypot(x - sun_x * width, y - sun_y * height))
    steps = np.minimum(most, distance.astype(int))
    share_x, share_y = (x + 0.5) / width, (y + 0.5) / height
    step_x, step_y = (sun_x - share_x) / distance, (sun_y - share_y) / distance
    # With single floats, as the number is the integer below a product.
    count = (np.float32(1) - np.float32(jitter)) * steps.astype(np.float32)
    total: Any = 0.0
    weights = np.zeros((height, width))
    going = np.ones((height, width), np.bool_)
    for i in range(int(count.max()) + 1):
        step: Any = np.full((height, width), float(i))
        if jitter > 0:
            step = (i + _hash(x, y)) / (1 - jitter) if jitter < 1 else 0 * step
        at_x, at_y = share_x + step * step_x, share_y + step * step_y
        going &= (at_x >= 0) & (at_y >= 0) & (at_x <= 1) & (at_y <= 1)
        weight = np.where(going & (i <= count.astype(int)), (1 - step / steps) ** 2, 0.0)
        seen = texels_at(upwards, at_x * width - 0.5, at_y * height - 0.5)
        total = total + weight[..., np.newaxis] * seen
        weights += weight
    mean = total / np.where(weights > 0, weights, 1.0)[..., np.newaxis]
    return {"light": store(np.where((weights > 0)[..., np.newaxis], mean, upwards))[::-1]}


LIGHTS: Final[dict[str, Any]] = {
    "streaks": _streaks,
    "ghosts": _ghosts,
    "fog_glow": _convolve,
    "kernel": _convolve,
    "simple_star": _simple_star,
    "sun_beams": _sun_beams,
}
#: The factors of a flat image, for each channel, of the types in which they are not 1.
GAINS: Final[dict[str, Any]] = {
    "streaks": _streaks_gain,
    "ghosts": _ghosts_gain,
    "fog_glow": lambda settings, size: settings.kernel_pixels(size).sum(axis=(0, 1)),
    "simple_star": lambda settings, size: np.full(3, 2.0),
}
