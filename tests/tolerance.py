"""How close a renderer's framebuffers have to be to those of `vkbloom.reference`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom import Frames, Settings, reference

FORMATS = {"uint8": "rgba8unorm", "float16": "rgba16float", "float32": "rgba32float"}
_DTYPES = {format: dtype for dtype, format in FORMATS.items()}

# Of the largest value of the framebuffer: the project's promise. 2e-3 is four roundings to half.
_RELATIVE = {"float16": 2e-3, "float32": 1e-4}

# Framebuffers in which one 8-bit stage's rounding arrives, or that of the glow and one more.
_FIRST_STAGES = ("glow", "blur_vertical", "down_0")


def tolerance(
    dtype: DTypeLike, expected: NDArray[np.float64], *, stages_of_8_bits: int = 1
) -> float:
    """Return the largest difference, in real units, that an array of that dtype may have.

    uint8: one level, or two where several stages follow each other, and the half level by which
    the unrounded reference is off in any case.
    """
    name = np.dtype(dtype).name
    if name == "uint8":
        return (1.5 if stages_of_8_bits == 1 else 2.5) / 255
    finite = np.abs(expected[np.isfinite(expected)])
    return _RELATIVE[name] * float(finite.max(initial=0.0))


def real(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return a framebuffer in real units: 0..1 for uint8."""
    values = array.astype(np.float64)
    return values / 255 if array.dtype == np.uint8 else values


def colours(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return the colours of a framebuffer in real units, without alpha."""
    return real(array[..., :3])


def assert_close(
    name: str, array: NDArray[Any], expected: NDArray[np.float64], limit: float
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
    place = np.unravel_index(int(np.abs(difference).argmax()), difference.shape)
    assert abs(difference[place]) <= limit, (
        f"{name}: {actual[place]:.8g} at {tuple(map(int, place))}, not {expected[place]:.8g}: "
        f"off by {abs(difference[place]):.3g}, {limit:.3g} allowed"
    )


def assert_matches_reference(frames: Frames, image: NDArray[Any], settings: Settings) -> None:
    """Compare all framebuffers: names in their order, shapes, dtypes, alpha, values."""
    expected = reference.apply(image, settings)
    assert list(frames) == list(expected)
    format = settings.format or FORMATS[image.dtype.name]
    passes_before_vertical = 2 * getattr(settings, "loops", 1) - 1
    limits = {}
    for name, array in frames.items():
        dtype = image.dtype if name == "final" else _DTYPES[format]
        assert array.dtype == dtype, f"{name}: {array.dtype}, not {dtype}"
        assert array.flags.c_contiguous, f"{name}: not contiguous"
        assert array.flags.owndata, f"{name}: does not own its memory"
        is_first = name in _FIRST_STAGES and (
            name != "blur_vertical" or passes_before_vertical == 1
        )
        limits[name] = tolerance(dtype, expected[name], stages_of_8_bits=1 if is_first else 2)
    if settings.bloom and _DTYPES[format] != image.dtype:
        # The coarser bloom's rounding goes through the composite into a finer final.
        limits["final"] += settings.intensity * limits["bloom"]
    for name, array in frames.items():
        assert_close(name, array, expected[name], limits[name])
        if name != "final":
            assert (real(array[..., 3]) == 1).all(), f"{name}: alpha is not 1"
    if image.shape[2] == 4:
        np.testing.assert_array_equal(frames["final"][..., 3], image[..., 3])
