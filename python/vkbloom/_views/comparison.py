"""Compare two images: how much they differ, where, and why they may not be comparable."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._formats import MAX_FLOAT
from vkbloom._io.picture import check_pixels
from vkbloom._io.srgb import decode_srgb

Metric = Literal["ssim", "psnr", "flip"]

# Side of scikit-image's default window in pixels.
_SSIM_WINDOW: Final = 7
#: Names of the metrics.
METRICS: Final[tuple[Metric, ...]] = get_args(Metric)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """The result of comparing two images.

    - `mismatches`: Reasons why the images do not match at any limits: another shape, integers
      against floats, NaN or infinity. If shape or kind differ, the figures are None.
    - `max_error`: Largest absolute difference of two finite values; integers are scaled to 0..1.
    - `max_error_at`: Its x, y and channel. None if there is no error.
    - `max_error_values`: The two values at that position.
    - `mean_error`: Mean absolute difference of all finite values.
    - `percent_over`: Percentage of pixels that have a channel which differs by more than
      `threshold` and `relative` allow, or which is not finite in only one image.
    - `threshold`, `relative`: The arguments of `compare`.
    - `data_range`: The data range for SSIM and PSNR: 1 for integers; for floats the range of the
      values, 0 and 1, which is 1 for images within 0..1.
    - `ssim`, `psnr`, `flip`: Structural similarity, peak signal-to-noise ratio in dB (inf if
      nothing differs) and mean FLIP.
    - `not_computed`: Why one of these is None, by its name; also "not asked for".
    """

    mismatches: tuple[str, ...]
    threshold: float
    relative: float = 0.0
    max_error: float | None = None
    max_error_at: tuple[int, int, int] | None = None
    max_error_values: tuple[float, float] | None = None
    mean_error: float | None = None
    percent_over: float | None = None
    data_range: float | None = None
    ssim: float | None = None
    psnr: float | None = None
    flip: float | None = None
    not_computed: Mapping[str, str]

    @property
    def identical(self) -> bool:
        """Whether all values are equal."""
        return not self.mismatches and not self.max_error


@dataclass(frozen=True, eq=False)
class Pair:
    """Two images of one shape, as float64, with the values that are not finite set to 0.

    Integers are scaled to 0..1; `error` is exact for them. `valid` is where both are finite,
    `unequal` where one has NaN or infinity that the other has not.
    """

    a: NDArray[np.float64]
    b: NDArray[np.float64]
    error: NDArray[np.float64]
    valid: NDArray[np.bool_]
    unequal: NDArray[np.bool_]
    is_integer: bool


def compare(
    a: NDArray[Any],
    b: NDArray[Any],
    *,
    threshold: float = 0.0,
    relative: float = 0.0,
    allow_nan: bool = False,
    metrics: Collection[Metric] = METRICS,
) -> Comparison:
    """Compare two images; `a` is the reference.

    They are (H, W) or (H, W, C); uint8 and uint16 are scaled to 0..1. All channels are compared,
    including alpha; FLIP uses the first three, or the first as grey. A pixel counts in
    `percent_over` if it differs by more than threshold + relative * abs(a). With `allow_nan`, NaN
    and infinity of the same sign are equal. SSIM and PSNR are scikit-image's (SSIM with its window
    of 7 x 7), FLIP is OpenImageIO's: LDR-FLIP of integers, HDR-FLIP of floats.
    Values that are not finite count as 0 in SSIM and FLIP only.
    """
    a, b = check_pixels("a", a), check_pixels("b", b)
    mismatches = _mismatches(a, b)
    if mismatches:
        return Comparison(
            mismatches=mismatches,
            threshold=threshold,
            relative=relative,
            not_computed=dict.fromkeys(METRICS, "the images are no match"),
        )
    pair = pair_of(a, b)
    unequal, common = pair.unequal, ~pair.valid & ~pair.unequal
    if unequal.any():
        mismatches += (f"NaN or infinity in one image only, {_positions(unequal)}",)
    if common.any() and not allow_nan:
        mismatches += (f"NaN or infinity in both images, {_positions(common)}",)
    low = min(0.0, float(pair.a.min()), float(pair.b.min()))
    high = max(1.0, float(pair.a.max()), float(pair.b.max()))
    data_range = 1.0 if pair.is_integer else high - low
    computed, not_computed = _metrics(pair, metrics, data_range)
    with np.errstate(over="ignore"):
        allowed = threshold + relative * np.abs(pair.a)
    over = (pair.error > allowed) | unequal
    position, values = _largest(pair)
    is_any = bool(pair.valid.any())
    return Comparison(
        mismatches=mismatches,
        threshold=threshold,
        relative=relative,
        max_error=float(pair.error.max()) if is_any else None,
        max_error_at=position,
        max_error_values=values,
        mean_error=float(pair.error.mean(where=pair.valid)) if is_any else None,
        percent_over=100.0 * float(over.any(axis=2).mean()),
        data_range=data_range,
        not_computed=not_computed,
        **computed,
    )


def difference(a: NDArray[Any], b: NDArray[Any]) -> tuple[NDArray[np.float32], float]:
    """Make a picture of the differences of two images, and return it with its scale."""
    pair = _comparable(a, b)
    largest = min(float(pair.error.max()), float(np.finfo(np.float64).max))
    scale = 1.0 / largest if largest else 1.0
    colours = 3 if pair.a.shape[2] >= 3 else 1
    picture = np.repeat(pair.error[:, :, :colours], 3 // colours, axis=2)
    if pair.a.shape[2] > colours:
        others = pair.error[:, :, colours:].max(axis=2, keepdims=True)
        picture = np.maximum(picture, others)
    with np.errstate(over="ignore"):
        picture = np.minimum(np.minimum(picture, largest) * scale, 1.0)
    picture[pair.unequal.any(axis=2)] = (1.0, 0.0, 1.0)
    return picture.astype(np.float32), scale


def _mismatches(a: NDArray[Any], b: NDArray[Any]) -> tuple[str, ...]:
    """Return the reasons why two images cannot be compared value by value."""
    results: list[str] = []
    if a.shape[:2] != b.shape[:2]:
        sizes = (f"{image.shape[1]} x {image.shape[0]}" for image in (a, b))
        results.append(f"the sizes differ, {' against '.join(sizes)}")
    if a.shape[2] != b.shape[2]:
        results.append(f"the numbers of channels differ, {a.shape[2]} against {b.shape[2]}")
    if a.dtype.kind != b.dtype.kind:
        results.append(f"integers against floats, {a.dtype} against {b.dtype}")
    return tuple(results)


def _comparable(a: NDArray[Any], b: NDArray[Any]) -> Pair:
    """Return a pair, or raise ValueError for images that cannot be compared value by value."""
    a, b = check_pixels("a", a), check_pixels("b", b)
    if mismatches := _mismatches(a, b):
        raise ValueError(f"a, b: not comparable: {'; '.join(mismatches)}")
    return pair_of(a, b)


def pair_of(a: NDArray[Any], b: NDArray[Any]) -> Pair:
    """Return two images of one shape as a pair."""
    whole = [np.iinfo(image.dtype).max if image.dtype.kind == "u" else 1 for image in (a, b)]
    is_integer = min(whole) > 1
    # 65535 = 257 * 255, so that 8-bit values convert to 16 bits exactly.
    scale = max(whole) if is_integer else 1
    a, b = (
        each.astype(np.float64) * (scale / one) for each, one in zip((a, b), whole, strict=True)
    )
    valid = np.isfinite(a) & np.isfinite(b)
    unequal = ~valid & (a != b) & ~(np.isnan(a) & np.isnan(b))
    a, b = np.where(valid, a, 0.0), np.where(valid, b, 0.0)
    # The difference of two doubles of opposite signs may overflow.
    with np.errstate(over="ignore"):
        return Pair(a / scale, b / scale, np.abs(a - b) / scale, valid, unequal, is_integer)


def _positions(where: NDArray[np.bool_]) -> str:
    """Describe the number of marked values of an (H, W, C) image, and the position of the first."""
    y, x, channel = (int(index[0]) for index in np.nonzero(where))
    return f"{int(where.sum())} values, the first at x {x}, y {y}, channel {channel}"


def _largest(pair: Pair) -> tuple[tuple[int, int, int] | None, tuple[float, float] | None]:
    """Return position (x, y, channel) and values of the largest error; None if there is none."""
    index = np.unravel_index(int(pair.error.argmax()), pair.error.shape)
    if not pair.error[index]:
        return None, None
    y, x, channel = (int(number) for number in index)
    return (x, y, channel), (float(pair.a[index]), float(pair.b[index]))


def _metrics(
    pair: Pair, wanted: Collection[Metric], data_range: float
) -> tuple[dict[str, float], dict[str, str]]:
    """Return the computed metrics, and the reasons for the others, by name."""
    measures: dict[Metric, Callable[[], float | str]] = {
        "ssim": lambda: _ssim(pair, data_range),
        "psnr": lambda: _psnr(pair, data_range),
        "flip": lambda: float(_flip(pair).mean(dtype=np.float64)),
    }
    computed: dict[str, float] = {}
    reasons: dict[str, str] = dict.fromkeys(set(METRICS) - set(wanted), "not asked for")
    for name in wanted:
        # Extreme floats give figures that are not finite.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            value = measures[name]()
        if isinstance(value, str):
            reasons[name] = value
        elif math.isnan(value) or value == -math.inf:
            reasons[name] = "the values are too large"
        else:
            computed[name] = value
    return computed, reasons


def _ssim(pair: Pair, data_range: float) -> float | str:
    metrics = import_extra("skimage.metrics", "quality", "Comparing images")
    if min(pair.a.shape[:2]) < _SSIM_WINDOW:
        return f"a side is under the window's {_SSIM_WINDOW} pixels"
    return float(
        metrics.structural_similarity(
            pair.a, pair.b, win_size=_SSIM_WINDOW, data_range=data_range, channel_axis=-1
        )
    )


def _psnr(pair: Pair, data_range: float) -> float | str:
    metrics = import_extra("skimage.metrics", "quality", "Comparing images")
    if not pair.valid.any():
        return "no values to compare"
    if not pair.error.any():
        return math.inf
    a, b = pair.a[pair.valid], pair.b[pair.valid]
    return float(metrics.peak_signal_noise_ratio(a, b, data_range=data_range))


def flip_map(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.float32]:
    """Return FLIP of every pixel; its mean is the figure of `compare`."""
    return _flip(_comparable(a, b))


def _linear(pair: Pair) -> list[NDArray[np.float32]]:
    """Return both images as linear (H, W, 3) of float32."""
    colours = 3 if pair.a.shape[2] >= 3 else 1
    largest = np.float32(MAX_FLOAT)
    results = []
    for image in (pair.a, pair.b):
        linear = image[:, :, :colours]
        if pair.is_integer:
            linear = decode_srgb(linear)
        limited = np.clip(linear, -largest, largest).astype(np.float32)
        results.append(np.repeat(limited, 3 // colours, axis=2))
    return results


def _flip(pair: Pair) -> NDArray[np.float32]:
    """Return OpenImageIO's FLIP of every pixel.

    Sources: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020;
    "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics 2021.
    """
    oiio = import_extra("OpenImageIO", "images", "Comparing images")
    first, second = _linear(pair)
    if np.array_equal(first, second):
        # With fused multiply-adds, as for aarch64, OpenImageIO subtracts a product that is rounded
        # from an equal one that is not, which leaves about 1e-6.
        return np.zeros(first.shape[:2], np.float32)
    buffers = [oiio.ImageBuf(image) for image in (first, second)]
    errors = oiio.ImageBufAlgo.FLIP_diff(*buffers, hdr=0 if pair.is_integer else 1)
    return np.asarray(errors.get_pixels(), np.float32)[:, :, 0]
