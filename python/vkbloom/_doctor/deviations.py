"""How much a renderer's framebuffers differ from those of `vkbloom.reference`, and may."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom import reference
from vkbloom._formats import FORMATS_BY_DTYPE
from vkbloom._renderer.frames import Frames
from vkbloom._settings.settings import Settings
from vkbloom.reference._compositing import slope_of

_DTYPES: Final = {format: dtype for dtype, format in FORMATS_BY_DTYPE.items()}

# A bound of all values, or of each.
Limit = float | NDArray[np.float64]

# Of float32, relative to the largest value of the framebuffer: the project's promise.
_SINGLE: Final = 1e-4

# What rounding to the nearest half float is off by: relative to the value, and below the smallest
# normal half, 2 ** -14.
_HALF_ROUNDING: Final = 2.0**-11
_MIN_HALF: Final = 2.0**-25


class Deviation(NamedTuple):
    """The value of an array that comes nearest to its limit, or is farthest beyond it.

    `wrong`: What is wrong with the array; "" if nothing is.
    """

    name: str
    off: float
    allowed: float
    wrong: str = ""

    @property
    def share(self) -> float:
        """The part of what is allowed; more than 1 is wrong."""
        if self.wrong and not self.off > self.allowed:
            return np.inf
        return self.off / self.allowed if self.off else 0.0


def tolerance(
    dtype: DTypeLike,
    expected: NDArray[np.float64],
    *,
    stages_of_8_bits: int = 1,
    stages: int = 4,
    magnitude: NDArray[np.float64] | None = None,
) -> Limit:
    """Return the largest difference, in real units, that an array of that dtype may have.

    uint8: one level, or two where several stages follow each other, and the half level by which
    the unrounded reference is off in any case. float16: for each value, what rounding it in so many
    stages is off by; `magnitude` is the sum of what was added up to it, without the signs, where
    some of that is negative. float32: relative to the largest value.
    """
    name = np.dtype(dtype).name
    if name == "uint8":
        return (1.5 if stages_of_8_bits == 1 else 2.5) / 255
    if name == "float16":
        size = np.nan_to_num(np.abs(expected if magnitude is None else magnitude), posinf=0.0)
        return stages * (_HALF_ROUNDING * size + _MIN_HALF)
    finite = np.abs(expected[np.isfinite(expected)])
    return _SINGLE * float(finite.max(initial=0.0))


def real(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return a framebuffer in real units: 0..1 for uint8."""
    values = array.astype(np.float64)
    return values / 255 if array.dtype == np.uint8 else values


def deviation(
    name: str, array: NDArray[Any], expected: NDArray[np.float64], limit: Limit
) -> Deviation:
    """Compare in real units; NaN and infinity must be the same in the same places."""
    if array.shape != expected.shape:
        return Deviation(name, np.nan, 0.0, f"{name}: shape {array.shape}, not {expected.shape}")
    actual = real(array)
    finite = np.isfinite(expected)
    if not np.array_equal(actual[~finite], expected[~finite], equal_nan=True):
        return Deviation(name, np.nan, 0.0, f"{name}: NaN or infinity changed")
    if not np.isfinite(actual[finite]).all():
        return Deviation(name, np.nan, 0.0, f"{name}: NaN or infinity came in")
    difference = np.zeros_like(expected)
    np.subtract(actual, expected, out=difference, where=finite)
    difference = np.abs(difference)
    limits = np.broadcast_to(limit, difference.shape)
    at = np.unravel_index(int((difference - limits).argmax()), difference.shape)
    off, allowed = float(difference[at]), float(limits[at])
    if off <= allowed:
        # Of all values, not of the one nearest to its limit, which a black one may be.
        at = np.unravel_index(int(difference.argmax()), difference.shape)
        return Deviation(name, float(difference[at]), float(limits[at]))
    wrong = (
        f"{name}: {actual[at]:.8g} at {tuple(map(int, at))}, not {expected[at]:.8g}: "
        f"off by {off:.3g}, {allowed:.3g} allowed"
    )
    return Deviation(name, off, allowed, wrong)


def _after_threshold(
    frames: Frames, image: NDArray[Any], settings: Settings, given: dict[str, Any]
) -> dict[str, NDArray[np.float64]]:
    """Return what the reference makes of the renderer's own glow."""
    mask, (height, width, _) = given.get("mask"), image.shape
    format = settings.format or FORMATS_BY_DTYPE[image.dtype.name]
    made = reference.passes(frames["glow"], settings, (width, height), format, mask=mask)
    share = 1.0 if mask is None else real(mask)[..., None]
    share = 0.0 if given.get("emission") is not None else share
    return made | {"final": reference.composite(image, made["bloom"], settings, share=share)}


def _limits(
    frames: Frames,
    expected: dict[str, NDArray[np.float64]],
    image: NDArray[Any],
    settings: Settings,
    given: dict[str, Any],
) -> dict[str, Limit]:
    format = settings.format or FORMATS_BY_DTYPE[image.dtype.name]
    magnitudes: dict[str, Any] = dict.fromkeys(expected, 0.0)
    if "float16" in (image.dtype.name, _DTYPES[format]):
        # A threshold takes away from a value, but not from what it was rounded by.
        sizes = dict(given)
        if sizes.get("emission") is not None:
            sizes["emission"] = np.abs(sizes["emission"])
        magnitudes |= reference.apply(np.abs(image), settings.replace(threshold=None), **sizes)
    limits = {}
    for index, name in enumerate(frames):
        limits[name] = tolerance(
            frames[name].dtype,
            expected[name],
            stages_of_8_bits=1 if name in settings._first_stages else 2,
            # No value has come through more passes than there are before it.
            stages=index + 1 + settings._hidden_stores(name),
            # (Where taps count less the brighter they are, signs may make more of them.)
            magnitude=np.maximum(np.abs(expected[name]), magnitudes[name]),
        )
        if settings._is_transform and frames[name].dtype == np.float32:
            # A transform's error is relative to the largest value that it is made of.
            limits[name] = max(limits[name], tolerance(np.float32, expected["glow"]))
        elif settings._is_transform:
            # So in halves it has some more than the rounding, where that is next to nothing.
            limits[name] = limits[name] + 0.01 * tolerance(np.float32, expected["glow"])
    if settings._bloom_error:
        error = settings._bloom_error * np.abs(expected["bloom"]).max()
        limits["bloom"] = limits["bloom"] + error
        slope = settings.intensity * slope_of(real(image), settings)
        limits["final"] = limits["final"] + slope * error
    if settings.bloom and _DTYPES[format] != image.dtype:
        # The coarser bloom's rounding goes through the composite into a finer final.
        of_bloom = np.broadcast_to(limits["bloom"], frames["bloom"].shape)[..., : image.shape[2]]
        slope = settings.intensity * slope_of(real(image), settings)
        limits["final"] = limits["final"] + slope * of_bloom
    return limits


def deviations(
    frames: Frames, image: NDArray[Any], settings: Settings, **given: Any
) -> Iterator[Deviation]:
    """Compare names, dtypes, shapes, values and alpha of all framebuffers, in their order."""
    expected = reference.apply(image, settings, **given)
    if list(frames) != list(expected):
        wrong = f"framebuffers: {', '.join(frames)}; not {', '.join(expected)}"
        yield Deviation("framebuffers", np.nan, 0.0, wrong)
        return
    if settings.threshold is not None and not settings._has_threshold_pass:
        # Its threshold comes after the glow, and magnifies what that was rounded by.
        glow = frames["glow"]
        yield deviation("glow", glow, expected["glow"], tolerance(glow.dtype, expected["glow"]))
        expected |= _after_threshold(frames, image, settings, given)
    limits = _limits(frames, expected, image, settings, given)
    format = settings.format or FORMATS_BY_DTYPE[image.dtype.name]
    dtypes = {"final": image.dtype.name, "kernel": "float32"}
    # Light that glare adds is not stored in 8 bits.
    wide = "float16" if format == "rgba8unorm" else _DTYPES[format]
    stages = tuple(item.stage for item in settings.glare)
    for name, array in frames.items():
        dtype = dtypes.get(name, wide if name.startswith(stages) else _DTYPES[format])
        if array.dtype != dtype:
            yield Deviation(name, np.nan, 0.0, f"{name}: {array.dtype}, not {dtype}")
            continue
        yield deviation(name, array, expected[name], limits[name])
        # (A kernel has no alpha.)
        has_alpha = name not in dtypes and settings.alpha != "blur"
        if has_alpha and not (real(array[..., 3]) == 1).all():
            yield Deviation(name, np.nan, 0.0, f"{name}: alpha is not 1")
    if image.shape[2] == 4 and settings.alpha == "keep":
        kept = frames["final"][..., 3], image[..., 3]
        if not np.array_equal(*kept, equal_nan=True):
            yield Deviation("final", np.nan, 0.0, "final: alpha is not the image's")
