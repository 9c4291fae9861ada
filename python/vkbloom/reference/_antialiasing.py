"""The temporal anti-aliasing of engines: how a frame is mixed with its history."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._image_arguments import check_depth, check_motion
from vkbloom._settings.antialiasing import NEIGHBOURS, Antialiasing

from ._image import finite
from ._sampling import Array, size_of

#: Half floats beyond which HDRP clamps.
_MAX_LIGHT: Final = 65472.0
#: HDRP adds them to a colour.
_BIASES: Final = np.array([0.0, 128 / 255, 128 / 255])


class _Frame(NamedTuple):
    """What a resolve reads.

    - `light`: (H, W, 3), finite; `motion`: (H, W, 2), now minus before, in shares of the sides;
      `depth`: (H, W), or None.
    - `history`: (H, W, 4); `last_motion`: (H, W, 2) of the frame before.
    - `first`: Whether there is no history.
    """

    light: Array
    motion: Array
    depth: Array | None
    history: Array
    last_motion: Array
    first: bool

    @property
    def size(self) -> Array:
        return np.array(size_of(self.light), np.float64)

    def pixels(self) -> NDArray[np.intp]:
        """Return column and row of each pixel."""
        height, width = self.light.shape[:2]
        rows, columns = np.mgrid[:height, :width]
        return np.stack([columns, rows], axis=-1).astype(np.intp)


class Resolving:
    """The anti-aliasing of a frame that continues a state."""

    def __init__(
        self,
        antialiasing: Antialiasing,
        motion: NDArray[Any] | None,
        depth: NDArray[Any] | None,
        state: Mapping[str, Any] | None,
    ) -> None:
        self.antialiasing = antialiasing
        self._motion, self._depth = motion, depth
        self._state = {} if state is None else state

    def resolve(self, picture: Array) -> tuple[Array, dict[str, Array]]:
        """Return the picture resolved, and the framebuffers; alpha and what is not finite stay."""
        frame = self._frame(picture)
        engine = _ENGINES[self.antialiasing.engine]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            kept = engine.resolve(frame, self.antialiasing)
            kept = np.concatenate([finite(kept[..., :3]), kept[..., 3:]], axis=-1)
            light = engine.show(kept[..., :3])
        resolved = picture.copy()
        resolved[..., :3] = np.where(np.isfinite(picture[..., :3]), light, picture[..., :3])
        framebuffers = {"history": kept}
        if engine.keeps_motion:
            rest = np.broadcast_to([0.0, 1.0], frame.motion.shape)
            framebuffers["history_motion"] = np.concatenate([frame.motion, rest], axis=-1)
        return resolved, framebuffers

    def _frame(self, picture: Array) -> _Frame:
        size = picture.shape[:2]
        motion = np.zeros((*size, 2))
        if self._motion is not None:
            motion = check_motion(self._motion, size, np.float64)
        depth = None if self._depth is None else check_depth(self._depth, size, np.float64)
        history = self._last("history", size)
        last = self._last("history_motion", size)
        flag = last if _ENGINES[self.antialiasing.engine].keeps_motion else history
        first = not flag[..., 3].any()
        return _Frame(finite(picture[..., :3]), motion, depth, history, last[..., :2], first)

    def _last(self, name: str, size: tuple[int, ...]) -> Array:
        if name not in self._state:
            return np.zeros((*size, 4))
        values = np.asarray(self._state[name], np.float64)
        if values.shape != (*size, 4):
            raise ValueError(f"state: {name} has shape {values.shape}, and not {(*size, 4)}")
        return values


# What engines share.


def _ycocg(colour: Array) -> Array:
    red, green, blue = np.moveaxis(colour, -1, 0)
    return np.stack(
        [(red + 2 * green + blue) / 4, (red - blue) / 2, (2 * green - red - blue) / 4], axis=-1
    )


def _rgb(colour: Array) -> Array:
    y, co, cg = np.moveaxis(colour, -1, 0)
    return np.stack([y + co - cg, y + cg, y - co - cg], axis=-1)


def _read(image: Array, at: NDArray[Any], outside: float | None = None) -> Array:
    """Return texels; beyond the edges the edge's, or `outside`."""
    height, width = image.shape[:2]
    last = np.array([width - 1, height - 1])
    columns, rows = np.moveaxis(np.clip(at, 0, last), -1, 0)
    values: Array = image[rows, columns]
    if outside is None:
        return values
    is_inside = ((at >= 0) & (at <= last)).all(axis=-1)
    return np.where(is_inside.reshape(is_inside.shape + (1,) * (image.ndim - 2)), values, outside)


def _bilinear(image: Array, place: Array) -> Array:
    """Sample at places in texels, from the upper left corner of the image on."""
    at = place - 0.5
    first = np.floor(at).astype(np.intp)
    x, y = np.moveaxis(at - first, -1, 0)[..., np.newaxis]
    steps = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    four = [_read(image, first + step) for step in steps]
    upper = four[0] * (1 - x) + four[1] * x
    lower = four[2] * (1 - x) + four[3] * x
    return np.asarray(upper * (1 - y) + lower * y)


def _before(frame: _Frame, motion: Array) -> Array:
    """Return where each pixel was in the frame before, in texels."""
    place = frame.pixels() + 0.5 - motion * frame.size
    # Beyond the edges all samples are alike.
    return np.clip(place, -8.0, frame.size + 8)


def _is_outside(frame: _Frame, place: Array) -> NDArray[np.bool_]:
    return np.asarray(((place < 0) | (place > frame.size)).any(axis=-1))


class _Cubic(NamedTuple):
    """The places and the weights of a cubic filter, whose middle two taps are one sample."""

    places: tuple[Array, Array, Array]
    weights: tuple[Array, Array, Array]

    def sample(self, image: Array, sampler: Callable[[Array, Array], Array], taps: Any) -> Array:
        """Return the sum of samples (column and row of the place, column and row of the weight)."""
        total: Any = 0.0
        for x, y, across, down in taps:
            place = np.stack([self.places[x][..., 0], self.places[y][..., 1]], axis=-1)
            weight = self.weights[across][..., 0] * self.weights[down][..., 1]
            total = total + sampler(image, place) * weight[..., np.newaxis]
        return np.asarray(total)

    def sum(self, taps: Any) -> Array:
        """Return the sum of the weights."""
        return np.asarray(
            sum(
                self.weights[across][..., 0] * self.weights[down][..., 1]
                for *_, across, down in taps
            )
        )[..., np.newaxis]


#: The taps of a cross, and those of all nine.
_CROSS: Final = ((1, 0, 1, 0), (0, 1, 0, 1), (1, 1, 1, 1), (2, 1, 2, 1), (1, 2, 1, 2))
_NINE: Final = tuple((x, y, x, y) for y in range(3) for x in range(3))
#: HDRP's: the right sample is in the upper row.
_HDRP_CROSS: Final = ((1, 0, 1, 0), (0, 1, 0, 1), (1, 1, 1, 1), (2, 0, 2, 1), (1, 2, 1, 2))


def _cubic(place: Array, c: Any) -> _Cubic:
    centre = np.floor(place - 0.5) + 0.5
    f = place - centre
    w0 = -c * f + 2 * c * f**2 - c * f**3
    w1 = 1 + (c - 3) * f**2 + (2 - c) * f**3
    g = 1 - f
    w3 = -c * g + 2 * c * g**2 - c * g**3
    w2 = 1 + (c - 3) * g**2 + (2 - c) * g**3
    middle = w1 + w2
    return _Cubic((centre - 1, centre + w2 / middle, centre + 2), (w0, middle, w3))


def _neighbours(image: Array, outside: float | None = None) -> Array:
    """Return the values of `NEIGHBOURS` of each pixel, (9, H, W, C)."""
    height, width = image.shape[:2]
    rows, columns = np.mgrid[:height, :width]
    at = np.stack([columns, rows], axis=-1)
    return np.stack([_read(image, at + offset, outside) for offset in NEIGHBOURS])


def _clip_to_box(colour: Array, mean: Array, extent: Array) -> Array:
    """Pull a colour along the line to the mean, until it is in the box around that."""
    away = colour - mean
    parts = np.where(away == 0, 0.0, np.abs(away) / extent)
    most = parts.max(axis=-1, keepdims=True)
    return np.where(most > 1, mean + away / most, colour)


def _nearest(
    frame: _Frame, offsets: Any, *, is_nearer: Any, depths: list[Array], start: Array
) -> NDArray[np.intp]:
    """Return the offset of the nearest pixel; of equal ones the first, or as `is_nearer` says."""
    best, chosen = start, np.zeros((*frame.light.shape[:2], 2), np.intp)
    for offset, depth in zip(offsets, depths, strict=True):
        nearer = is_nearer(depth, best)
        best = np.where(nearer, depth, best)
        chosen = np.where(nearer[..., np.newaxis], np.asarray(offset, np.intp), chosen)
    return chosen


# Bevy.


def _resolve_bevy(frame: _Frame, settings: Any) -> Array:
    now = frame.light / (1 + frame.light.max(axis=-1, keepdims=True))
    if frame.first:
        return np.dstack([now, np.full(now.shape[:2], 1 / settings.min_weight)])
    chosen = np.zeros(frame.motion.shape, np.intp)
    if frame.depth is not None:
        offsets = ((-2, 2), (2, 2), (-2, -2), (2, -2))
        depths = [_read(frame.depth, frame.pixels() + offset) for offset in offsets]
        chosen = _nearest(frame, offsets, is_nearer=np.greater, depths=depths, start=frame.depth)
    motion = _read(frame.motion, frame.pixels() + chosen)
    place = _before(frame, motion)
    history = _cubic(place, 0.5).sample(frame.history[..., :3], _bilinear, _CROSS)
    around = _ycocg(_neighbours(now))
    mean = around.mean(axis=0)
    deviation = np.sqrt(np.maximum((around**2).mean(axis=0) - mean**2, 0))
    clipped = np.clip(_rgb(_clip_to_box(_ycocg(history), mean, deviation + 1e-8)), 0, 1)
    is_still = (np.abs(motion * frame.size) < settings.still).all(axis=-1)
    confidence = np.where(is_still, frame.history[..., 3] + 10, 1.0)
    weight = np.clip(1 / confidence, settings.min_weight, settings.weight)
    outside = _is_outside(frame, place)
    weight = np.where(outside, 1.0, weight)[..., np.newaxis]
    confidence = np.where(outside, 1.0, confidence)
    return np.dstack([clipped * (1 - weight) + now * weight, confidence])


def _show_bevy(kept: Array) -> Array:
    return np.asarray(kept / np.maximum(1 - kept.max(axis=-1, keepdims=True), 2.0**-24))


# Godot.


def _reinhard(light: Array) -> Array:
    return light / (1 + light)


def _resolve_godot(frame: _Frame, settings: Any) -> Array:
    if frame.first:
        return np.dstack([frame.light, np.zeros(frame.light.shape[:2])])
    height = frame.size[1]
    chosen = np.zeros(frame.motion.shape, np.intp)
    if frame.depth is not None:
        depths = [_read(frame.depth, frame.pixels() + offset) for offset in NEIGHBOURS]
        start = np.ones(frame.depth.shape)
        chosen = _nearest(frame, NEIGHBOURS, is_nearer=np.less, depths=depths, start=start)
    motion = _read(frame.motion, frame.pixels() + chosen - 1, 0.0)
    place = _before(frame, motion)
    now = _reinhard(frame.light)
    sampled = _cubic(place, 0.5).sample(frame.history[..., :3], _bilinear, _NINE)
    history = _reinhard(np.maximum(sampled, 0))

    around = _ycocg(_neighbours(now))
    weights = 1 / (1 + around[..., :1])
    mean = (weights * around).sum(axis=0) / weights.sum(axis=0)
    square = (weights * around**2).sum(axis=0) / weights.sum(axis=0)
    box = np.clip(1188 / height, 0.75, 1.0)
    slow = np.clip(1 - np.linalg.norm(motion, axis=-1) / (128 / 1080), 0, 1)[..., np.newaxis]
    extent = (
        np.sqrt(np.abs(square - mean**2))
        * box
        * (settings.moving_box + (1 - settings.moving_box) * slow**2)
    )
    history = np.clip(_rgb(mean + _clip_by_axes(_ycocg(history) - mean, extent)), 1e-8, 32767.0)

    last = _read(frame.last_motion, np.trunc(place).astype(np.intp), 0.0)
    apart = np.linalg.norm((last - motion) * frame.size, axis=-1) - settings.disocclusion
    reset = np.clip(_is_outside(frame, place) + np.clip(0.01 * apart, 0, 1), 0, 1)
    count = _bilinear(frame.history[..., 3:], place)[..., 0] * (1 - reset)
    luminances = (np.maximum(c @ np.array([0.299, 0.587, 0.114]), 1e-4) for c in (now, history))
    one, other = luminances
    alike = (1 - np.abs(one - other) / np.maximum(np.maximum(one, other), 1.001)) ** 2
    weight = np.clip(alike / (count + 1) + reset, 0, 1)[..., np.newaxis]
    mixed = history * (1 - weight) + now * weight
    resolved = mixed / np.maximum(1 - mixed, 2.0**-24)
    return np.dstack([resolved, np.minimum(count + 1, settings.frames)])


def _clip_by_axes(away: Array, extent: Array) -> Array:
    """Shorten a difference axis by axis, first at the upper ends of the box."""
    for sign in (1.0, -1.0):
        for axis in range(3):
            part, end = sign * away[..., axis], extent[..., axis]
            factor = np.where(part > end + 1e-8, end / part, 1.0)
            away = away * factor[..., np.newaxis]
    return away


# O3DE.


def _resolve_o3de(frame: _Frame, settings: Any) -> Array:
    around = _ycocg(_neighbours(frame.light, 0.0))
    weights, number = _weights_of_frame(frame, settings)
    now = np.tensordot(weights, around, axes=(0, 0))
    mean = around.mean(axis=0)
    variance = (around**2).mean(axis=0) - mean**2
    deviation = settings.gamma * np.sqrt(np.maximum(variance, 0))

    chosen = np.zeros(frame.motion.shape, np.intp)
    if frame.depth is not None:
        # First the pixel, then a cross, then the corners.
        offsets = ((0, 0), (1, 0), (0, -1), (-1, 0), (0, 1), (1, -1), (1, 1), (-1, -1), (-1, 1))
        depths = [_read(frame.depth, frame.pixels() + offset, 0.0) for offset in offsets]
        start = np.ones(frame.depth.shape)
        chosen = _nearest(frame, offsets, is_nearer=np.less, depths=depths, start=start)
    motion = _read(frame.motion, frame.pixels() + chosen, 0.0)
    place = _before(frame, motion)
    first = np.floor(place - 0.5).astype(np.intp)
    green = np.stack(
        [_read(frame.history[..., 1], first + step) for step in ([0, 0], [1, 0], [0, 1], [1, 1])]
    )
    c = 0.5 / (1 + np.ptp(green, axis=0)[..., np.newaxis])
    cubic = _cubic(place, c)
    history = _ycocg(cubic.sample(frame.history[..., :3], _bilinear, _CROSS) / cubic.sum(_CROSS))
    away = history - mean
    parts = np.where(away == 0, 1.0, deviation / np.abs(away))
    clipped = mean + away * np.minimum(parts.min(axis=-1, keepdims=True), 1)

    apart = np.abs(clipped[..., 0] - now[..., 0])
    share = np.where(apart == 0, 1.0, settings.damping * deviation[..., 0] / apart)
    weight = settings.weight * np.clip(share**2, 0, 1)
    weight = np.where(_is_outside(frame, place), 1.0, weight)[..., np.newaxis]
    resolved = np.maximum(_rgb(clipped * (1 - weight) + now * weight), 0)
    return np.dstack([resolved, np.full(resolved.shape[:2], number)])


def _weights_of_frame(frame: _Frame, settings: Antialiasing) -> tuple[Array, float]:
    """Return the weights of the neighbours in this frame, and the number of frames with it."""
    rows = np.array(settings.filter_weights() or [[0.0] * 9])
    before = int(frame.history[0, 0, 3])
    after = before + 1
    # The number stays small, and not 0.
    after -= len(rows) if after >= 2 * len(rows) else 0
    return rows[before % len(rows)], float(after)


# Unity HDRP.


def _biased(light: Array) -> Array:
    return np.asarray(_ycocg(light) + _BIASES)


def _compressed(light: Array) -> Array:
    """Return a colour of HDRP: (Y, Co + b, Cg + b) / (1 + Y)."""
    colour = _biased(light)
    return colour / (1 + colour[..., :1])


def _expanded(colour: Array) -> Array:
    """Return the light of such a colour."""
    return _rgb(colour / (1 - colour[..., :1]) - _BIASES)


def _fetch(image: Array, place: Array) -> Array:
    """Sample bilinearly, not beyond one texel before the right and the lower edge."""
    size = np.array(size_of(image), np.float64)
    return _bilinear(image, np.minimum(place, size - 1))


def _motion_hdrp(frame: _Frame) -> Array:
    if frame.depth is None:
        return frame.motion
    pixels = frame.pixels()
    quad = 2 * (pixels & 1) - 1

    def depth_at(x: int, y: int) -> Array:
        assert frame.depth is not None
        return _read(frame.depth, pixels + quad * [x, y], 0.0)

    own = depth_at(-1, 0) + depth_at(0, -1) - frame.depth
    # Of equal depths the last one counts.
    best, chosen = frame.depth, np.zeros(pixels.shape, np.intp)
    corners = (((-1, -1), own), ((1, 1), None), ((1, -1), None), ((-1, 1), None))
    for step, given in corners:
        depth = depth_at(*step) if given is None else given
        nearer = depth >= best
        best = np.where(nearer, depth, best)
        chosen = np.where(nearer[..., np.newaxis], quad * step, chosen)
    return _read(frame.motion, pixels + chosen)


def _resolve_hdrp(frame: _Frame, settings: Any) -> Array:
    motion = _motion_hdrp(frame)
    last = frame.light if frame.first else frame.history[..., :3]
    place = _before(frame, motion)
    if settings.quality == "low" or settings.history_sharpening == 0:
        history = _fetch(last, place)
    else:
        cubic = _cubic(place, settings.history_sharpening)
        history = cubic.sample(last, _fetch, _HDRP_CROSS) / cubic.sum(_HDRP_CROSS)
    history = np.clip(history, 0, _MAX_LIGHT)
    margin = 0.5
    off_screen = ((place <= margin) | (place >= frame.size - margin)).any(axis=-1, keepdims=True)

    centres = np.asarray(frame.pixels() + 0.5, np.float64)
    around = np.stack(
        [
            np.clip(_fetch(frame.light, centres + np.array(offset)), 0, _MAX_LIGHT)
            for offset in NEIGHBOURS
        ]
    )
    if settings.quality == "low":
        resolved = _resolve_hdrp_low(around[[1, 3, 5, 7]], around[4], history, off_screen, settings)
        return np.dstack([resolved, np.ones(resolved.shape[:2])])

    weights, number = _weights_of_frame(frame, settings)
    around = _compressed(around)
    now = around[4]
    used = around
    if settings.quality == "high":
        now = np.tensordot(weights, around, axes=(0, 0))
    else:
        used = around[[1, 3, 4, 5, 7]]
    others = around[[1, 3, 5, 7]] if settings.quality == "medium" else np.delete(around, 4, axis=0)
    history = np.where(off_screen, now, _compressed(history))
    deviations = _deviations(now[..., 0], history[..., 0], motion, frame.size, settings)
    mean = used.mean(axis=0)
    extent = np.sqrt(np.abs((used**2).mean(axis=0) - mean**2)) * deviations[..., np.newaxis]
    clipped = _clip_to_box(history, mean, extent)

    light, average = _expanded(now), _expanded(others.mean(axis=0))
    light = light + settings.sharpening * 3 * np.maximum(light - average, 0)
    sharpened = _compressed(np.clip(light, 0, _MAX_LIGHT))
    weight = _blend_hdrp(history[..., 0], 2 * extent[..., 0], settings)
    mixed = clipped * (1 - weight) + sharpened * weight
    resolved = np.clip(_expanded(mixed), 0, _MAX_LIGHT)
    return np.dstack([resolved, np.full(resolved.shape[:2], number)])


def _deviations(now: Array, history: Array, motion: Array, size: Array, settings: Any) -> Array:
    """Return how many deviations the history may be from the mean, by luminances."""
    contrast = np.clip(np.abs(now - history) / np.maximum(np.maximum(now, history), 0.2), 0, 1)
    part = np.clip((contrast - 0.05) / (settings.flicker_contrast - 0.05), 0, 1)
    most: Any = 3.5 * settings.anti_flicker
    if settings.quality == "high":
        pixels = np.linalg.norm(motion, axis=-1) * np.linalg.norm(size)
        still = np.clip(1 - 2 * pixels, 0, 1)
        most = most * (0.8 * (1 - still) + 2.25 * still)
    return np.asarray(1.5 + most * part**2 * (3 - 2 * part))


def _blend_hdrp(history: Array, contrast: Array, settings: Any) -> Array:
    """Return this frame's share; NaN counts as 0."""
    share = (1 - settings.base_blend) / (1 + np.maximum(contrast, 0) / history)
    return np.asarray(np.maximum(np.fmin(np.fmax(share, 0), 1), 0.03)[..., np.newaxis])


def _resolve_hdrp_low(
    others: Array, now: Array, history: Array, off_screen: Any, settings: Any
) -> Array:
    def luminance(colour: Array) -> Array:
        return np.asarray(colour @ np.array([0.2126729, 0.7151522, 0.0721750]))

    history = np.where(off_screen, now, history)
    low, high = np.minimum(others.min(axis=0), now), np.maximum(others.max(axis=0), now)
    clipped = np.clip(history, low, high)
    light = now + settings.sharpening * 3 * np.maximum(now - others.mean(axis=0), 0)
    light = np.clip(light, 0, _MAX_LIGHT)
    weight = _blend_hdrp(luminance(history), luminance(high) - luminance(low), settings)
    one, other = (c / (1 + luminance(c)[..., np.newaxis]) for c in (clipped, light))
    mixed = one * (1 - weight) + other * weight
    return np.clip(mixed / (1 - luminance(mixed)[..., np.newaxis]), 0, _MAX_LIGHT)


class _Engine(NamedTuple):
    """An engine: what it keeps of a frame, and the light of that."""

    resolve: Callable[[_Frame, Any], Array]
    show: Callable[[Array], Array] = np.asarray
    keeps_motion: bool = False


_ENGINES: Final[Mapping[str, _Engine]] = {
    "bevy": _Engine(_resolve_bevy, _show_bevy),
    "godot": _Engine(_resolve_godot, keeps_motion=True),
    "o3de": _Engine(_resolve_o3de),
    "hdrp": _Engine(_resolve_hdrp),
}
