"""The exposures of engines: what they meter in a frame, and how they adapt to it.

The state of an exposure is one number (`Adapted.value`); what it means is the engine's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._array_api import run_in_other_libraries
from vkbloom._arrays import copy_to_host
from vkbloom._public import public
from vkbloom._settings.exposure import DEFAULT_SECONDS, Exposure, check_exposure, check_seconds

from ._image import as_float
from ._sampling import Array, sample

_WEIGHTS_709: Final = (0.2126729, 0.7151522, 0.0721750)


class Metered(NamedTuple):
    """What a frame tells: a number, which means what the engine takes, and the bins before it."""

    value: float
    histogram: Array | None = None


class Adapted(NamedTuple):
    """What an exposure has adapted to, and what it multiplies.

    - `before`: The factor of the light that the bloom reads; `after`: that of the picture with its
      bloom. `final` has both.
    """

    value: float
    before: float
    after: float


class _Engine(NamedTuple):
    """An engine: what it meters; what follows from that, the last value (None: none) and dt."""

    meter: Callable[[Array, Any], Metered]
    adapt: Callable[[Any, float, float | None, float], Adapted]


@public("vkbloom.reference")
@run_in_other_libraries("image")
@check_arguments
def expose(
    image: NDArray[Any],
    exposure: Exposure | str,
    *,
    dt: float = DEFAULT_SECONDS,
    state: Mapping[str, Any] | None = None,
) -> dict[str, Array]:
    """Meter a frame and adapt to it, in float64.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3) or (H, W, 4)
        Linear light: uint8 (read as value / 255), float16, float32 or float64.
    exposure : Exposure or str
        An exposure, or the name of one of `vkbloom.exposures`.
    dt : float
        Seconds since the frame before, 0 to 86400.
    state : mapping of str to ndarray, optional
        The result of the frame before. Only its "exposure" is read. None: the first frame.

    Returns
    -------
    dict of str to ndarray of float64
        "histogram", shape (1, bins, 4): the weight of each bin in r, g and b, and an alpha of 1;
        of exposures that have one. "exposure", shape (1, 1, 4): what has been adapted to, the
        multiplier before the bloom, the one after it, and 1. "exposed": the image times both
        multipliers; alpha stays.

    Raises
    ------
    ValueError
        The image has another shape, `dt` is out of range, or the state's "exposure" has another
        shape.

    Examples
    --------
    >>> grey = np.full((8, 8, 3), 0.18)
    >>> vkbloom.reference.expose(grey, "o3de", dt=1)["exposed"][0, 0].round(6)
    array([0.18, 0.18, 0.18])
    """
    pixels = as_float(image, "image", (3, 4))
    stage = Exposing(check_exposure(exposure), dt, state)
    framebuffers = stage.adapt(pixels)
    both = stage.adapted.before * stage.adapted.after
    return framebuffers | {"exposed": stage.multiply(pixels, both)}


class Exposing:
    """An exposure of a frame that continues a state."""

    def __init__(
        self, exposure: Exposure, dt: float | None, state: Mapping[str, Any] | None
    ) -> None:
        self.exposure = exposure
        self._seconds = check_seconds("dt", dt)
        self._last = _last_value(state)
        self.adapted = Adapted(0.0, 1.0, 1.0)

    def adapt(self, picture: Array) -> dict[str, Array]:
        """Meter a picture, and return the framebuffers."""
        engine = _ENGINES[self.exposure.engine]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            light = copy_to_host(picture[..., :3])
            metered = engine.meter(light, self.exposure)
            self.adapted = engine.adapt(self.exposure, metered.value, self._last, self._seconds)
        framebuffers: dict[str, Array] = {}
        if metered.histogram is not None:
            bins = np.ones((1, len(metered.histogram), 4))
            bins[0, :, :3] = metered.histogram[:, np.newaxis]
            framebuffers["histogram"] = bins
        framebuffers["exposure"] = np.array([[[*self.adapted, 1.0]]])
        return framebuffers

    def multiply(self, picture: Array, multiplier: float) -> Array:
        """Return a picture times a multiplier; alpha stays."""
        exposed = picture.copy()
        with np.errstate(invalid="ignore", over="ignore"):
            exposed[..., :3] *= multiplier
        return exposed


def _last_value(state: Mapping[str, Any] | None) -> float | None:
    if state is None or "exposure" not in state:
        return None
    values = np.asarray(copy_to_host(state["exposure"]), np.float64)
    if values.shape != (1, 1, 4):
        raise ValueError(f"state: exposure has shape {values.shape}, and not (1, 1, 4)")
    return float(values[0, 0, 0]) if values[0, 0, 3] else None


def _saturate(values: Any) -> Any:
    """Clamp to 0..1; NaN becomes 0."""
    return np.fmin(np.fmax(values, 0.0), 1.0)


def _clamp(value: float, low: float, high: float) -> float:
    """Clamp; NaN becomes the lower limit."""
    return float(np.fmin(np.fmax(value, low), high))


def _luminance(light: Array, weights: tuple[float, float, float]) -> Array:
    return np.asarray(light @ np.array(weights))


def _cut(counts: Array, low: float, high: float) -> Array:
    """Return the part of each bin's count between two numbers of all counts, from the darkest."""
    ends = np.clip(np.concatenate([[0.0], counts.cumsum()]), low, high)
    return np.diff(ends)


def _count(bins: NDArray[np.intp], weights: Array, count: int) -> Array:
    """Return the sum of the weights of each bin."""
    return np.bincount(bins.ravel(), weights.ravel(), count).astype(np.float64)


def _cut_percents(counts: Array, exposure: Any) -> Array:
    total = float(counts.sum()) / 100
    return _cut(counts, exposure.percent_min * total, exposure.percent_max * total)


def _mean(values: Array, weights: Array, empty: float) -> float:
    total = float(weights.sum())
    return float(values @ weights) / total if total > 0 else empty


def _ev100(luminance: Array, grey: float) -> Array:
    return np.asarray(np.log2(100 * luminance / grey))


def _multiplier(ev100: float) -> float:
    return float(1 / (1.2 * np.exp2(ev100)))


def _half_lives(seconds: float, rate: float) -> float:
    """Return the share of a distance that is left behind if half is left after 1 / rate seconds."""
    return 1 - math.exp2(-seconds * rate)


# Without a meter.


def _fixed_multiplier(value: float, unit: str) -> float:
    return float(2.0**value) if unit == "stop" else _multiplier(value)


def _adapt_fixed(exposure: Any, _: float, __: float | None, dt: float) -> Adapted:
    return Adapted(exposure.value, _fixed_multiplier(exposure.value, exposure.unit), 1.0)


def _adapt_keyframed(exposure: Any, _: float, last: float | None, dt: float) -> Adapted:
    # What is adapted to is the time in seconds.
    time = 0.0 if last is None else last + dt
    value = float(np.interp(time, *np.array(exposure.keys).T))
    return Adapted(time, _fixed_multiplier(value, exposure.unit), 1.0)


# Bevy.


def _meter_bevy(light: Array, exposure: Any) -> Metered:
    low, high = exposure.range_min, exposure.range_max
    luminance = _luminance(light, (0.2125, 0.7154, 0.0721))
    share = _saturate((np.log2(luminance) - low) / (high - low))
    bins = np.where(luminance < 2.0**low, 0, np.floor(1 + 62 * share)).astype(np.intp)
    weights = np.full(bins.shape, 16.0)
    if exposure.mask is not None:
        rows, columns = (
            np.floor(np.arange(side) / side * texels).astype(np.intp)
            for side, texels in zip(bins.shape, exposure.mask.array.shape, strict=True)
        )
        weights = np.floor(16 * exposure.mask.array[np.ix_(rows, columns)].astype(np.float64))
    histogram = _count(bins, weights, 64)
    total = histogram.sum()
    ends = (np.floor(share * total) for share in (exposure.filter_min, exposure.filter_max))
    kept = _cut(histogram, *ends)
    steps = _mean(np.arange(1, 64.0), kept[1:], 0.0)
    return Metered(low + (high - low) * steps / 63, histogram)


def _adapt_bevy(exposure: Any, metered: float, last: float | None, dt: float) -> Adapted:
    table, first, end, least, spread = exposure.compensation_table()
    place = math.floor(255 * _saturate((metered - first) / (end - first)))
    target = least + spread * table[place] / 255 - metered
    value = _clamp(0.0, exposure.range_min, exposure.range_max) if last is None else last
    distance = target - value
    if distance > 0:
        step = exposure.speed_darken * dt
        value += min(step, distance * step / exposure.transition)
    else:
        step = exposure.speed_brighten * dt
        value += max(-step, distance * step / exposure.transition)
    return Adapted(value, 1.0, float(np.exp2(value)))


# Unity HDRP.


def _hdrp_weights(exposure: Any, luminance: Array) -> Array:
    """Return the weight of each pixel of a grid, whose luminance this is."""
    height, width = luminance.shape
    y, x = np.arange(height)[:, np.newaxis], np.arange(width)[np.newaxis]
    from_centre = np.hypot(x - width / 2, y - height / 2)
    mean_side = (width + height) / 2
    if exposure.metering == "spot":
        return np.asarray(1 - _saturate(from_centre - 0.075 * mean_side))
    if exposure.metering == "center_weighted":
        return np.asarray(1 - _saturate(from_centre / mean_side))
    if exposure.metering == "mask":
        return _bilinear(exposure.mask.array.astype(np.float64), (x / width, y / height))
    if exposure.metering == "procedural":
        radii = exposure.radius_x * width, exposure.radius_y * height
        radius = max(radii)
        distance = np.hypot(
            (x - exposure.centre_x * width) * radius / radii[0],
            (y - exposure.centre_y * height) * radius / radii[1],
        )
        weights = _saturate(1 - (distance / radius) ** (1 / exposure.softness))
        low, high = (exposure.grey / 100 * 2.0**ev for ev in (exposure.mask_min, exposure.mask_max))
        return np.where((luminance > low) & (luminance < high), weights, 0.0)
    return np.ones(luminance.shape)


def _bilinear(image: Array, places: tuple[Array, Array]) -> Array:
    """Sample (h, w) at shares of width and height; the edge is repeated."""
    height, width = image.shape
    x, y = (share * side - 0.5 for share, side in zip(places, (width, height), strict=True))
    x0, y0 = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    columns = [np.clip(x0 + step, 0, width - 1) for step in (0, 1)]
    rows = [np.clip(y0 + step, 0, height - 1) for step in (0, 1)]
    upper, lower = (
        image[row, columns[0]] * (1 - x + x0) + image[row, columns[1]] * (x - x0) for row in rows
    )
    return np.asarray(upper * (1 - y + y0) + lower * (y - y0))


def _meter_hdrp(light: Array, exposure: Any) -> Metered:
    luminance = _luminance(light, _WEIGHTS_709)
    low, high = exposure.limit_min, exposure.limit_max
    if exposure.mode == "automatic":
        # (Not with `sample`, whose sums of rows spread NaN.)
        centres = (np.arange(1024) + 0.5) / 1024
        grid = _bilinear(luminance, (centres[np.newaxis], centres[:, np.newaxis]))
        return Metered(_automatic_mean(grid, exposure))
    share = _saturate((_ev100(luminance, exposure.grey) - low) / (high - low))
    bins = np.floor(127 * share).astype(np.intp)[::2, ::2]
    weights = np.floor(2048 * _hdrp_weights(exposure, luminance))[::2, ::2]
    histogram = _count(bins, weights, 128)
    kept = _cut_percents(histogram, exposure)
    return Metered(_mean(low + np.arange(128) / 127 * (high - low), kept, low), histogram)


def _automatic_mean(luminance: Array, exposure: Any) -> float:
    weights = _hdrp_weights(exposure, luminance)
    values = weights * _ev100(np.fmax(luminance, 1e-4), exposure.grey)
    tiles, shares = (part.reshape(32, 32, 32, 32).sum(axis=(1, 3)) for part in (values, weights))
    is_finite = np.isfinite(tiles)
    total = np.where(is_finite, tiles, 1.0).sum()
    weight = np.where(is_finite, shares, 1.0).sum()
    return float(total / weight) if weight > 0 else 0.0


def _adapt_hdrp(exposure: Any, metered: float, last: float | None, dt: float) -> Adapted:
    target = metered - exposure.compensation
    before = 1.0 if last is None else _multiplier(last)
    value = target
    if last is not None:
        is_up = target > last
        rate = exposure.speed_dark_to_light if is_up else exposure.speed_light_to_dark
        value = last + (target - last) * _half_lives(dt, rate)
    return Adapted(_clamp(value, exposure.limit_min, exposure.limit_max), before, 1.0)


# Unity Post Processing v2.


def _meter_ppv2(light: Array, exposure: Any) -> Metered:
    height, width = light.shape[:2]
    padded = np.pad(light, ((1, 0), (1, 0), (0, 0)), mode="edge")
    corners = (padded[:-1, :-1] + padded[:-1, 1:] + padded[1:, :-1] + padded[1:, 1:])[::2, ::2] / 4
    share = _saturate((np.log2(_luminance(corners, _WEIGHTS_709)) + 9) / 18)
    bins = np.floor(127 * share).astype(np.intp)
    x, y = np.arange(0, width, 2)[np.newaxis], np.arange(0, height, 2)[:, np.newaxis]
    vignette = _saturate(1 - (x / width - 0.5) ** 2 - (y / height - 0.5) ** 2)
    histogram = _count(bins, np.floor(64 * vignette**2), 128)
    kept = _cut_percents(histogram, exposure)
    mean = _mean(2.0 ** (18 * np.arange(128) / 128 - 9), kept, 0.0)
    return Metered(_clamp(mean, 2.0**exposure.minimum, 2.0**exposure.maximum), histogram)


def _adapt_ppv2(exposure: Any, metered: float, last: float | None, dt: float) -> Adapted:
    value = target = exposure.key_value / max(metered, 1e-4)
    if last is not None:
        rate = exposure.speed_down if target > last else exposure.speed_up
        value = last + (target - last) * _half_lives(dt, rate)
    return Adapted(value, value, 1.0)


# Godot.


def _meter_godot(light: Array, exposure: Any) -> Metered:
    means = np.fmax.reduce(light, axis=2)
    while means.size > 1:
        means = _block_means(means)
    return Metered(float(means[0, 0]))


def _block_means(image: Array) -> Array:
    """Return the means of 8 x 8 pixels; a side below 8 is one block."""
    height, width = (max(1, side // 8) for side in image.shape)
    rows, columns = (min(8, side) for side in image.shape)
    kept = image[: height * rows, : width * columns]
    return np.asarray(kept.reshape(height, rows, width, columns).mean(axis=(1, 3)))


def _adapt_godot(exposure: Any, metered: float, last: float | None, dt: float) -> Adapted:
    value = metered
    if last is not None:
        low, high = (
            sensitivity * 0.125 / exposure.sensitivity
            for sensitivity in (exposure.min_sensitivity, exposure.max_sensitivity)
        )
        value = _clamp(last + (metered - last) * exposure.speed * dt, low, high)
    return Adapted(value, float(np.divide(exposure.scale, value)), 1.0)


# O3DE.


def _meter_o3de(light: Array, exposure: Any) -> Metered:
    return Metered(float(_luminance(light, (0.27222872, 0.67408168, 0.05368952)).mean()))


def _adapt_o3de(exposure: Any, metered: float, last: float | None, dt: float) -> Adapted:
    mean = metered if math.isfinite(metered) else 0.18
    goal = _clamp(float(np.log2(mean / 0.18)), exposure.minimum, exposure.maximum)
    value = 0.0 if last is None else last
    speed = exposure.speed_up if goal > value else exposure.speed_down
    value += (goal - value) * min(dt, 1.0) * speed
    return Adapted(value, 1.0, float(np.exp2(-value)))


# Granite.


def _meter_granite(light: Array, exposure: Any) -> Metered:
    size = tuple(max(1, -(-side // 2)) for side in light.shape[1::-1])
    brightest = np.fmax.reduce(sample(light, size), axis=2)
    logs = np.log2(brightest + 1e-4)[..., np.newaxis]
    taps = ((-1.75, 0.25), (0.0, 0.5), (1.75, 0.25))
    for _ in range(4):
        size = tuple(max(1, -(-side // 2)) for side in size)
        logs = sample(logs, size, taps, taps)
    size = tuple(max(1, side // 2) for side in size)
    return Metered(float(sample(logs, size).mean()))


def _adapt_granite(exposure: Any, metered: float, last: float | None, dt: float) -> Adapted:
    low, high = exposure.minimum, exposure.maximum
    goal = _clamp(metered, low, high) if math.isfinite(metered) else low
    before = 0.0 if last is None else last
    value = before + (goal - before) * _half_lives(dt, 1.0)
    return Adapted(value, float(np.exp2(-before)), float(np.exp2(before - value)))


def _meter_nothing(light: Array, exposure: Any) -> Metered:
    return Metered(0.0)


_ENGINES: Final[Mapping[str, _Engine]] = {
    "fixed": _Engine(_meter_nothing, _adapt_fixed),
    "keyframed": _Engine(_meter_nothing, _adapt_keyframed),
    "bevy": _Engine(_meter_bevy, _adapt_bevy),
    "hdrp": _Engine(_meter_hdrp, _adapt_hdrp),
    "ppv2": _Engine(_meter_ppv2, _adapt_ppv2),
    "godot": _Engine(_meter_godot, _adapt_godot),
    "o3de": _Engine(_meter_o3de, _adapt_o3de),
    "granite": _Engine(_meter_granite, _adapt_granite),
}
