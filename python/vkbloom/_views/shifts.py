"""Find by how many pixels one image is shifted against another, also by parts of a pixel."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra

_Image = NDArray[np.float64]
_Shift = tuple[float, float]

#: The smallest shift that is named, in pixels.
MIN_SHIFT: Final = 1 / 64
# A shift explains a difference if at most this share of it (root mean square) remains. By parts of
# a pixel, the image may have been interpolated by another filter.
_REMAINS: Final = 0.1
_REMAINS_OF_WHOLE: Final = 0.02
_MAX_SHIFT: Final = 0.25  # of the image's side
# Shifts by quarters and eighths are tried, too: the estimate is less exact than its judgement.
_PARTS: Final = (4, 8)


def find_shift(a: _Image, b: _Image, step: float) -> tuple[_Shift, float] | None:
    """Return the shift (x, y) of `b` against `a`, and the residual; None if no shift explains `b`.

    `a`, `b`: (H, W, C); `step`: a level of integers, 0 for floats. None also without scikit-image.
    """
    try:
        registration = import_extra("skimage.registration", "quality", "Finding a shift")
        ndimage = import_extra("scipy.ndimage", "quality", "Finding a shift")
    except ModuleNotFoundError:
        return None
    # Bright lights alone would decide otherwise, and interpolations differ in high frequencies.
    grey_a, grey_b = (
        ndimage.gaussian_filter(_compress(image).mean(axis=2), 1, mode="wrap") for image in (a, b)
    )
    (y, x), *_ = registration.phase_cross_correlation(
        grey_b, grey_a, upsample_factor=64, normalization=None
    )
    rounded = [(round(n * x) / n + 0.0, round(n * y) / n + 0.0) for n in _PARTS]
    for shift in dict.fromkeys((*rounded, (float(x), float(y)))):
        is_short = max(abs(shift[0]) / a.shape[1], abs(shift[1]) / a.shape[0]) <= _MAX_SHIFT
        if is_short and max(map(abs, shift)) >= MIN_SHIFT:
            residual = _residual(a, b, shift, step)
            if residual is not None:
                return shift, residual
    return None


def _residual(a: _Image, b: _Image, shift: _Shift, step: float) -> float | None:
    """Return the residual of the interpolation that explains `b` best, or None."""
    inner = _inner(a.shape, shift)
    share = _REMAINS_OF_WHOLE if _is_whole(shift) else _REMAINS
    best: float | None = None
    for moved, target, reference in _interpolations(a, b, shift):
        images = [image[inner] for image in (moved, target, reference)]
        small = [_compress(image) for image in images]
        if all(_is_explained(*three, share=share, step=step) for three in (images, small)):
            residual = rms((target - moved)[inner])
            best = residual if best is None else min(best, residual)
    return best


def _interpolations(a: _Image, b: _Image, shift: _Shift) -> Iterator[tuple[_Image, _Image, _Image]]:
    """Yield a moved image, the one that it should be, and the one that it is made of."""
    ndimage = import_extra("scipy.ndimage", "quality", "Finding a shift")
    x, y = shift
    yield ndimage.shift(a, (y, x, 0), order=1, mode="grid-wrap"), b, a
    if _is_whole(shift):
        return
    # The first image may be an interpolation of the second.
    yield ndimage.shift(b, (-y, -x, 0), order=1, mode="grid-wrap"), a, b
    yield ndimage.shift(a, (y, x, 0), order=3, mode="mirror"), b, a
    spectrum = ndimage.fourier_shift(np.fft.fft2(a, axes=(0, 1)), (y, x, 0))
    yield np.fft.ifft2(spectrum, axes=(0, 1)).real, b, a


def _is_whole(shift: _Shift) -> bool:
    return all(abs(value - round(value)) < MIN_SHIFT for value in shift)


def _is_explained(
    moved: _Image, target: _Image, reference: _Image, *, share: float, step: float
) -> bool:
    difference = rms(target - reference)
    return difference > 2 * step and rms(target - moved) <= share * difference + step / 2


def _compress(image: _Image) -> _Image:
    compressed: _Image = image / (1 + np.abs(image))
    return compressed


def _inner(shape: tuple[int, ...], shift: _Shift) -> tuple[slice, slice]:
    """Return the rows and columns that a shift does not bring in from outside the image."""
    x, y = (
        min(int(abs(value)) + 2, side // 3) for value, side in zip(shift, shape[1::-1], strict=True)
    )
    return slice(y, shape[0] - y), slice(x, shape[1] - x)


def rms(values: NDArray[Any]) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0
