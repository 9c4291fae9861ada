"""The allowed differences of a renderer's framebuffers from those of `vkbloom.reference`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom import (
    BlenderGlare,
    DualKawase,
    Frames,
    GodotBloom,
    Pyramid,
    Separable,
    Settings,
    _core,
    reference,
)

FORMATS = {"uint8": "rgba8unorm", "float16": "rgba16float", "float32": "rgba32float"}
_DTYPES = {format: dtype for dtype, format in FORMATS.items()}

# A bound of all values, or of each.
Limit = float | NDArray[np.float64]

# Of float32, relative to the largest value of the framebuffer: the project's promise.
_SINGLE = 1e-4

# What rounding to the nearest half float is off by: relative to the value, and below the smallest
# normal half, 2 ** -14.
_HALF_ROUNDING = 2.0**-11
_HALF_LEAST = 2.0**-25

# The threshold pass of these methods writes the glow.
_WITH_THRESHOLD_PASS = (Separable, Pyramid, DualKawase, BlenderGlare)

# Framebuffers in which one 8-bit stage's rounding arrives, or that of the glow and one more.
_FIRST_STAGES = ("glow", "blur_vertical", "down_0")


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
        return stages * (_HALF_ROUNDING * size + _HALF_LEAST)
    finite = np.abs(expected[np.isfinite(expected)])
    return _SINGLE * float(finite.max(initial=0.0))


def real(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return a framebuffer in real units: 0..1 for uint8."""
    values = array.astype(np.float64)
    return values / 255 if array.dtype == np.uint8 else values


def colours(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return the colours of a framebuffer in real units, without alpha."""
    return real(array[..., :3])


def assert_close(
    name: str, array: NDArray[Any], expected: NDArray[np.float64], limit: Limit
) -> None:
    """Compare in real units; NaN and infinity must be the same in the same places."""
    assert array.shape == expected.shape, f"{name}: shape {array.shape}, not {expected.shape}"
    actual = real(array)
    finite = np.isfinite(expected)
    assert np.array_equal(actual[~finite], expected[~finite], equal_nan=True), (
        f"{name}: NaN or infinity changed"
    )
    assert np.isfinite(actual[finite]).all(), f"{name}: NaN or infinity came in"
    difference = np.zeros_like(expected)
    np.subtract(actual, expected, out=difference, where=finite)
    allowed = np.broadcast_to(limit, difference.shape)
    place = np.unravel_index(int((np.abs(difference) - allowed).argmax()), difference.shape)
    assert abs(difference[place]) <= allowed[place], (
        f"{name}: {actual[place]:.8g} at {tuple(map(int, place))}, not {expected[place]:.8g}: "
        f"off by {abs(difference[place]):.3g}, {allowed[place]:.3g} allowed"
    )


def _slope(image: NDArray[Any], settings: Settings) -> Limit:
    """Return how much of a difference of the bloom, after its intensity, is in `final` at most.

    Godot's screen is s + g - s g / white, of which s may be any number.
    """
    if not isinstance(settings, GodotBloom) or settings.composite != "screen":
        return 1.0
    scene = real(image) * 2.0**settings.exposure
    slope: NDArray[np.float64] = np.maximum(1.0, np.abs(1.0 - scene / settings.white))
    return slope


def assert_matches_reference(
    frames: Frames,
    image: NDArray[Any],
    settings: Settings,
    *,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
) -> None:
    """Compare all framebuffers: names in their order, shapes, dtypes, alpha, values."""
    expected = reference.apply(image, settings, mask=mask, emission=emission)
    assert list(frames) == list(expected)
    format = settings.format or FORMATS[image.dtype.name]
    if settings.threshold is not None and not isinstance(settings, _WITH_THRESHOLD_PASS):
        # Its threshold comes after the glow, and magnifies what that was rounded by.
        limit = tolerance(_DTYPES[format], expected["glow"], stages_of_8_bits=1)
        assert_close("glow", frames["glow"], expected["glow"], limit)
        height, width, _ = image.shape
        glow = frames["glow"]
        expected |= reference.passes(glow, settings, (width, height), format, mask=mask)
        share = 0.0 if emission is not None else 1.0 if mask is None else real(mask)[..., None]
        expected["final"] = reference.composite(image, expected["bloom"], settings, share=share)
    passes_before_vertical = 2 * getattr(settings, "loops", 1) - 1
    hidden = passes_before_vertical - 1
    if isinstance(settings, Separable):
        hidden += len(settings.layers) - 1
    magnitudes: dict[str, Any] = dict.fromkeys(expected, 0.0)
    if "float16" in (image.dtype.name, _DTYPES[format]):
        # A threshold takes away from a value, but not from what it was rounded by.
        sizes = None if emission is None else np.abs(emission)
        magnitudes |= reference.apply(
            np.abs(image), settings.replace(threshold=None), mask=mask, emission=sizes
        )
    limits = {}
    for index, (name, array) in enumerate(frames.items()):
        dtype = image.dtype if name == "final" else _DTYPES[format]
        if name == "kernel":
            dtype = np.dtype(np.float32)
        assert array.dtype == dtype, f"{name}: {array.dtype}, not {dtype}"
        assert array.flags.c_contiguous, f"{name}: not contiguous"
        is_own = array.flags.owndata or isinstance(array.base, _core.Pages)
        assert is_own, f"{name}: does not own its memory"
        is_first = name in _FIRST_STAGES and (
            name != "blur_vertical" or passes_before_vertical == 1
        )
        limits[name] = tolerance(
            dtype,
            expected[name],
            stages_of_8_bits=1 if is_first else 2,
            # No value has come through more passes than there are before it.
            # (Blender's glow are the highlights of a frame, which is an image of its own.)
            stages=index + 1 + (hidden if index else 0) + isinstance(settings, BlenderGlare),
            # (Where taps count less the brighter they are, signs may make more of them.)
            magnitude=np.maximum(np.abs(expected[name]), magnitudes[name]),
        )
    if settings.bloom and _DTYPES[format] != image.dtype:
        # The coarser bloom's rounding goes through the composite into a finer final.
        of_bloom = np.broadcast_to(limits["bloom"], frames["bloom"].shape)[..., : image.shape[2]]
        slope = settings.intensity * _slope(image, settings)
        limits["final"] = limits["final"] + slope * of_bloom
    for name, array in frames.items():
        assert_close(name, array, expected[name], limits[name])
        # (A kernel has no alpha.)
        if name not in ("final", "kernel") and settings.alpha != "blur":
            assert (real(array[..., 3]) == 1).all(), f"{name}: alpha is not 1"
    if image.shape[2] == 4 and settings.alpha == "keep":
        np.testing.assert_array_equal(frames["final"][..., 3], image[..., 3])
