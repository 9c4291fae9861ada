"""Sequences of pictures: flashes that harm by WCAG 2.2, and flicker that is seen."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final, Literal, get_args, overload

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._arrays import copy_to_host, plain_array
from vkbloom._extras import import_extra
from vkbloom._formats import LUMINANCE
from vkbloom._io.srgb import decode_srgb, encode_srgb
from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom._spelling import did_you_mean
from vkbloom.testing._bt1702 import FlashVerdict, judge_flashes
from vkbloom.testing._display import Display, Encoding, as_display
from vkbloom.testing._flash_rules import FlashRules

#: Rules by which sequences are judged: WCAG 2.2, Rec. ITU-R BT.1702, and BT.1702 as IRIS has it.
Standard = Literal["wcag22", "bt1702", "iris"]

# WCAG 2.2, "general flash and red flash thresholds": changes of at least a tenth of the largest
# relative luminance, the darker of which is below 0.8; more than three flashes within a second, on
# a quarter of any field of ten degrees.
_CHANGE: Final = 0.1
_DARK: Final = 0.8
_RED: Final = 0.8
_RED_CHANGE: Final = 20 / 320
_FLASHES: Final = 3
_FIELD: Final = 10.0
_SHARE: Final = 0.25
_LUMINANCE: Final = np.array(LUMINANCE)
# The longer side of the pictures that are judged, in pixels: a field has about this many.
_FIELD_PIXELS: Final = 32
# Allowance for roundings of a difference that is exactly the limit.
_EXACT: Final = 1e-6


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class Flash:
    """Flashes of a sequence, by the thresholds of WCAG 2.2.

    Attributes
    ----------
    general, red : bool
        Whether the sequence fails: there are more than three flashes within a second, on at least
        a quarter of a field of ten degrees.
    flashes, red_flashes : int
        The most flashes of a pixel within a second.
    area, red_area : float
        The largest share of a field that has more than three flashes within a second, 0 to 1.
    second : float
        Where the worst second begins.
    """

    general: bool
    red: bool
    flashes: int
    red_flashes: int
    area: float
    red_area: float
    second: float

    @property
    def failed(self) -> bool:
        """Whether the sequence fails."""
        return self.general or self.red

    def __str__(self) -> str:
        """Return a line for each kind of flash."""
        return "\n".join(
            f"{name} flashes: {'fails' if failed else 'passes'}, up to {count} a second, on "
            f"{100 * area:.3g} % of a field of 10 degrees"
            for name, failed, count, area in (
                ("general", self.general, self.flashes, self.area),
                ("red", self.red, self.red_flashes, self.red_area),
            )
        )


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class Flicker:
    """How visible the flicker of a sequence is.

    Attributes
    ----------
    jod : float or None
        Quality in just-objectionable-difference units of ColorVideoVDP, 10 without flicker; None if
        the package ``cvvdp`` is not installed.
    frequencies : ndarray of float64, shape (N,)
        In Hz, from one period of the sequence to half of the frame rate.
    contrast : ndarray of float64, shape (N,)
        Amplitude of the luminance at each frequency, divided by its mean, at the pixel where it is
        the largest.
    """

    jod: float | None
    frequencies: NDArray[np.float64]
    contrast: NDArray[np.float64]


@overload
def flash(
    frames: Iterable[NDArray[Any]],
    fps: float,
    *,
    degrees: float | None = None,
    standard: Literal["wcag22"] = "wcag22",
    display: None = None,
) -> Flash: ...
@overload
def flash(
    frames: Iterable[NDArray[Any]],
    fps: float,
    *,
    degrees: float | None = None,
    standard: Literal["bt1702", "iris"] | FlashRules,
    display: Display | Encoding | None = None,
) -> FlashVerdict: ...
@public("vkbloom.testing")
@check_arguments
def flash(
    frames: Iterable[NDArray[Any]],
    fps: float,
    *,
    degrees: float | None = None,
    standard: Standard | FlashRules = "wcag22",
    display: Display | Encoding | None = None,
) -> Flash | FlashVerdict:
    """Judge flashes of a sequence by WCAG 2.2 or by Rec. ITU-R BT.1702.

    By WCAG 2.2, a general flash is a pair of opposing changes of relative luminance by at least
    0.1, where the darker picture is below 0.8. A red flash is a pair of opposing changes of
    max(0, R - G - B) by more than 20 / 320, one of whose pictures is a saturated red: R / (R + G +
    B) of at least 0.8. A sequence fails if a quarter of any field of ten degrees has more than
    three flashes within a second.

    By BT.1702, luminance is absolute: changes of 20 cd/m2 and more, whose darker picture is below
    160 cd/m2, or with a Michelson contrast of at least 1 / 17 above it on displays of HDR. More
    than six changes within a second that oppose each other, each of a quarter of the picture at
    the same time, fail, and so do six stripes or more on a quarter of the picture for half a
    second. `FlashRules` has all numbers, with sources.

    Parameters
    ----------
    frames : iterable of ndarray, shape (H, W, 3) or (H, W, 4)
        Integers are in sRGB, or the signal of `display`; floats are linear light, and 1 is the
        white of the display. What the display does not show is clamped.
    fps : float
        Frames per second.
    degrees : float, optional
        Width of the picture in degrees of the field of view, such as 40 for a monitor. WCAG 2.2
        needs it; BT.1702 judges shares of the picture.
    standard : {"wcag22", "bt1702", "iris"} or FlashRules
        The rules. "iris" has those of EA's IRIS in its own configuration, which judges the mean of
        the picture: ``FlashRules.iris()``.
    display : Display or {"srgb", "pq", "hlg"}, optional
        What BT.1702 judges by; a name has the defaults of `Display`. Default: SDR with a white of
        200 cd/m2. WCAG 2.2 takes none.

    Returns
    -------
    Flash or FlashVerdict
        `Flash` by WCAG 2.2, else `FlashVerdict`. Both have `general` and `red`: whether it fails.

    Notes
    -----
    Sources: W3C, Web Content Accessibility Guidelines 2.2, success criterion 2.3.1 and "general
    flash and red flash thresholds"; 0.006 steradians are a quarter of a field of ten degrees. Rec.
    ITU-R BT.1702.
    """
    check_number("fps", fps, 1e-3, 1e5)
    if degrees is not None:
        check_number("degrees", degrees, 1e-3, 360.0)
    if standard != "wcag22":
        return judge_flashes(_checked(frames), fps, _rules_of(standard), as_display(display))
    if degrees is None:
        raise ValueError(
            "degrees: WCAG 2.2 judges fields of ten degrees; give the width of the picture, such "
            "as degrees=40"
        )
    if display is not None:
        raise ValueError(
            'display: WCAG 2.2 judges relative luminance; give standard="bt1702" for luminance in '
            "cd/m2"
        )
    return _judge_by_wcag(frames, fps, degrees)


def _rules_of(standard: str | FlashRules) -> FlashRules:
    """Return the rules of a name."""
    if isinstance(standard, FlashRules):
        return standard
    if standard == "bt1702":
        return FlashRules()
    if standard == "iris":
        return FlashRules.iris()
    known = get_args(Standard)
    text = f"standard: {standard!r} is not one of {', '.join(known)}, or a FlashRules"
    if not isinstance(standard, str):
        raise TypeError(text)
    raise ValueError(f"{text}{did_you_mean(standard, known)}")


def _judge_by_wcag(frames: Iterable[NDArray[Any]], fps: float, degrees: float) -> Flash:
    luminances, reds, saturated = [], [], []
    for light in _lights(frames, degrees):
        luminances.append(light @ _LUMINANCE)
        reds.append(np.maximum(0, light[..., 0] - light[..., 1] - light[..., 2]))
        total = light.sum(axis=2)
        saturated.append((light[..., 0] >= (_RED - _EXACT) * total) & (total > 0))
    field = _FIELD / degrees * luminances[0].shape[1]
    general = _flashes(luminances, fps, field, _CHANGE, lambda low, i, j: low < _DARK)
    red = _flashes(
        reds, fps, field, _RED_CHANGE, lambda low, i, j: _at(saturated, i) | _at(saturated, j)
    )
    return Flash(
        general=general[1] >= _SHARE,
        red=red[1] >= _SHARE,
        flashes=general[0],
        red_flashes=red[0],
        area=general[1],
        red_area=red[1],
        second=max(general, red, key=lambda match: match[1])[2],
    )


def _at(planes: list[NDArray[np.bool_]], index: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return of each pixel the value in its own frame."""
    return np.asarray(np.take_along_axis(np.stack(planes), index[np.newaxis], axis=0)[0])


def _flashes(
    planes: list[NDArray[np.float64]], fps: float, field: float, change: float, counts: Any
) -> tuple[int, float, float]:
    """Return the most flashes of a pixel in a second, the largest share of a field, and when.

    A change runs from one extreme of a pixel to the next. It begins to count once it is as large as
    `change` and `counts(darker value, frame of its start, frame)` is true.
    """
    shape = planes[0].shape
    direction, counted = np.zeros(shape, np.int8), np.zeros(shape, np.bool_)
    low, high = planes[0].copy(), planes[0].copy()
    start, darker = np.zeros(shape, np.intp), planes[0].copy()
    lowest_at, highest_at = np.zeros(shape, np.intp), np.zeros(shape, np.intp)
    changes: list[NDArray[np.bool_]] = []
    for index, plane in enumerate(planes):
        lowest_at, low = np.where(plane < low, index, lowest_at), np.minimum(plane, low)
        highest_at, high = np.where(plane > high, index, highest_at), np.maximum(plane, high)
        rises = (plane - low >= change - _EXACT) & (direction != 1)
        falls = (high - plane >= change - _EXACT) & (direction != -1) & ~rises
        turned = rises | falls
        start = np.where(rises, lowest_at, np.where(falls, highest_at, start))
        darker = np.where(rises, low, np.where(falls, plane, np.minimum(darker, plane)))
        direction = np.where(rises, 1, np.where(falls, -1, direction)).astype(np.int8)
        counted &= ~turned
        new = (direction != 0) & ~counted & counts(darker, start, np.full_like(start, index))
        counted |= new
        changes.append(new)
        # The extreme at the end of this change is searched from here on.
        lowest_at, low = np.where(turned, index, lowest_at), np.where(turned, plane, low)
        highest_at, high = np.where(turned, index, highest_at), np.where(turned, plane, high)
    frames = math.floor(fps + _EXACT) + 1
    total = np.cumsum(np.stack(changes), axis=0, dtype=np.int32)
    most, area, when = 0, 0.0, 0.0
    for end in range(len(planes)):
        first = end - frames
        pairs = (total[end] - (total[first] if first >= 0 else 0)) // 2
        most = max(most, int(pairs.max()))
        if (pairs > _FLASHES).any():
            share = _largest_share(pairs > _FLASHES, field)
            if share > area:
                area, when = share, max(0, first + 1) / fps
    return most, area, when


def _largest_share(flashing: NDArray[np.bool_], field: float) -> float:
    """Return the largest share of a disc with the diameter `field` that is flashing.

    Of a picture smaller than the field, the rest of the field counts as calm.
    """
    radius = field / 2
    reach = math.ceil(radius)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    disc = (x**2 + y**2 <= radius**2).astype(np.float64)
    padded = np.pad(flashing.astype(np.float64), reach)
    shape = tuple(a + b - 1 for a, b in zip(padded.shape, disc.shape, strict=True))
    sums = np.fft.irfft2(np.fft.rfft2(padded, shape) * np.fft.rfft2(disc, shape), shape)
    return min(1.0, float(sums.max() / disc.sum()))


def _lights(frames: Iterable[NDArray[Any]], degrees: float) -> Iterator[NDArray[np.float64]]:
    """Yield the linear light of each frame, reduced to about the pixels that a field needs."""
    for frame in _checked(frames):
        yield _reduce(_linear(frame[..., :3]), degrees)


def _checked(frames: Iterable[NDArray[Any]]) -> Iterator[NDArray[Any]]:
    """Yield frames that are images of one shape, at least 2."""
    if not isinstance(frames, Iterable):
        raise TypeError(f"frames: {frames!r} is not a sequence of images")
    shape: tuple[int, ...] | None = None
    count = 0
    for count, frame in enumerate(frames, start=1):  # noqa: B007  it is read after the loop
        array = plain_array(copy_to_host(frame), "frames")
        if array.ndim != 3 or array.shape[2] not in (3, 4) or array.dtype.kind not in "uf":
            raise ValueError(
                f"frames: shape {array.shape} of {array.dtype} is not (H, W, 3) or (H, W, 4) of "
                "integers or floats"
            )
        if shape not in (None, array.shape):
            raise ValueError(f"frames: shape {array.shape} after {shape}; all must be the same")
        shape = array.shape
        yield array
    if count < 2:
        raise ValueError(f"frames: {count} given; a sequence has at least 2")


def _linear(colours: NDArray[Any]) -> NDArray[np.float64]:
    if colours.dtype.kind == "f":
        return np.clip(np.nan_to_num(colours.astype(np.float64)), 0, 1)
    return decode_srgb(colours / np.iinfo(colours.dtype).max)


def _reduce(light: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    """Return the means of square boxes, so that a field has about `_FIELD_PIXELS` boxes."""
    height, width, _ = light.shape
    side = max(1, int(width * _FIELD / degrees / _FIELD_PIXELS))
    side = min(side, height, width)
    kept = light[: height // side * side, : width // side * side]
    boxes = kept.reshape(height // side, side, width // side, side, 3)
    means: NDArray[np.float64] = boxes.mean(axis=(1, 3))
    return means


@public("vkbloom.testing")
@check_arguments
def flicker(frames: Iterable[NDArray[Any]], fps: float) -> Flicker:
    """Measure how visible the flicker of a sequence is.

    Parameters
    ----------
    frames : iterable of ndarray, shape (H, W, 3) or (H, W, 4)
        As for `flash`. A sequence of something that does not move.
    fps : float
        Frames per second.

    Returns
    -------
    Flicker
        With the package ``cvvdp``, `jod` compares the sequence with its mean picture, as
        ColorVideoVDP does for a standard display in 4K; all frames are then held in memory.

    Notes
    -----
    Source: Mantiuk et al., "ColorVideoVDP: A visual difference predictor for image, video and
    display distortions", SIGGRAPH 2024, https://doi.org/10.1145/3658144.
    """
    check_number("fps", fps, 1e-3, 1e5)
    judges = find_spec("pycvvdp") is not None
    kept = list(frames) if isinstance(frames, Iterable) and judges else frames
    lights = np.stack(list(_lights(kept, _FIELD)))
    luminances = lights @ _LUMINANCE
    mean = luminances.mean(axis=0)
    count = len(luminances)
    amplitudes = 2 * np.abs(np.fft.rfft(luminances, axis=0))[1:] / count
    if count % 2 == 0:
        amplitudes[-1] /= 2
    largest = max(float(mean.max()), 1e-300)
    contrast = (amplitudes / np.maximum(mean, 1e-3 * largest)).max(axis=(1, 2))
    return Flicker(
        jod=_jod(kept, fps) if judges and isinstance(kept, list) else None,
        frequencies=np.asarray(np.fft.rfftfreq(count, 1 / fps)[1:], np.float64),
        contrast=contrast,
    )


def _jod(frames: list[NDArray[Any]], fps: float) -> float:
    package = import_extra("pycvvdp", "cvvdp", "The JOD of flicker")
    lights = np.stack([_linear(np.asarray(frame)[..., :3]).astype(np.float32) for frame in frames])
    still = np.broadcast_to(lights.mean(axis=0), lights.shape)
    metric = package.cvvdp(display_name="standard_4k", heatmap=None, quiet=True)
    encoded = [encode_srgb(x).astype(np.float32) for x in (lights, still)]
    jod, _ = metric.predict(*encoded, dim_order="FHWC", frames_per_second=fps)
    return float(jod)
