"""Find by how many pixels one image is shifted against another, also by parts of a pixel."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["MIN_SHIFT", "find_shift"]

_Image = NDArray[np.float64]
_Shift = tuple[float, float]

#: The smallest shift that is named, in pixels.
MIN_SHIFT: Final = 1 / 64
# A shift explains a difference if at most this share of it (root mean square) remains. By parts of
# a pixel, the image may have been interpolated by another filter.
_REMAINS: Final = 0.1
_REMAINS_OF_WHOLE: Final = 0.02
_WINDOW: Final = 256  # pixels; the side of the part in which a shift is searched
_LONGEST: Final = 0.25  # of the image's side
# Shifts by quarters and eighths are tried, too: the estimate is less exact than its judgement.
_PARTS: Final = (4, 8)
_PADDING: Final = 16  # pixels; mirrored edges, so that the prefilter of splines does not ring


def find_shift(a: _Image, b: _Image, step: float) -> tuple[_Shift, float] | None:
    """Return the shift (x, y) of `b` against `a`, and the residual; None if no shift explains `b`.

    `a`, `b`: (H, W, C); `step`: a level of integers, 0 for floats.
    """
    # Bright lights alone would decide otherwise.
    small_a, small_b = _compressed(a), _compressed(b)
    window = _brightest_window(small_a + small_b)
    height, width = a.shape[:2]
    tried: set[_Shift] = set()
    for start in ((0, 0), _whole_shift(small_a.mean(axis=2), small_b.mean(axis=2))):
        if max(abs(start[0]) / width, abs(start[1]) / height) > _LONGEST:
            continue
        refined = _refined(_smoothed(small_a), _smoothed(small_b), window, start)
        for shift in (*(_rounded(refined, parts) for parts in _PARTS), refined):
            if shift in tried or max(map(abs, shift)) < MIN_SHIFT:
                continue
            tried.add(shift)
            part = (slice(None), slice(None)) if min(height, width) < 2 * _WINDOW else window
            # Most pairs are refused by a part of them.
            if _residual(a[part], b[part], shift, step) is None:
                continue
            residual = _residual(a, b, shift, step)
            if residual is not None:
                return shift, residual
    return None


def _rounded(shift: _Shift, parts: int) -> _Shift:
    x, y = (round(parts * value) / parts + 0.0 for value in shift)
    return x, y


def _residual(a: _Image, b: _Image, shift: _Shift, step: float) -> float | None:
    """Return the residual of the interpolation that explains `b` best, or None."""
    inner = _inner(a.shape, shift)
    share = _REMAINS_OF_WHOLE if _is_whole(shift) else _REMAINS
    best: float | None = None
    for moved, found, reference in _interpolations(a, b, shift):
        images = [image[inner] for image in (moved, found, reference)]
        small = [_compressed(image) for image in images]
        if all(_is_explained(*three, share=share, step=step) for three in (images, small)):
            residual = _rms((found - moved)[inner])
            best = residual if best is None else min(best, residual)
    return best


def _interpolations(a: _Image, b: _Image, shift: _Shift) -> Iterator[tuple[_Image, _Image, _Image]]:
    """Yield a moved image, the one that it should be, and the one that it is made of."""
    yield _moved(a, shift), b, a
    if _is_whole(shift):
        return
    # The first image may be an interpolation of the second.
    yield _moved(b, (-shift[0], -shift[1])), a, b
    yield _moved(a, shift, _catmull_rom), b, a
    for is_spline in (True, False):
        yield _filtered(a, shift, is_spline=is_spline), b, a


def _is_whole(shift: _Shift) -> bool:
    return all(abs(value - round(value)) < MIN_SHIFT for value in shift)


def _is_explained(
    moved: _Image, found: _Image, reference: _Image, *, share: float, step: float
) -> bool:
    difference = _rms(found - reference)
    return difference > 2 * step and _rms(found - moved) <= share * difference + step / 2


def _compressed(image: _Image) -> _Image:
    compressed: _Image = image / (1 + np.abs(image))
    return compressed


def _smoothed(image: _Image) -> _Image:
    """Return an image without the high frequencies, in which interpolations differ."""
    for axis in (0, 1):
        for _ in range(2):
            image = (np.roll(image, 1, axis) + 2 * image + np.roll(image, -1, axis)) / 4
    return image


def _whole_shift(a: _Image, b: _Image) -> tuple[int, int]:
    """Return the shift (x, y) of `b` against `a` in whole pixels, by their cross-correlation."""
    spectra = [np.fft.rfft2(image - image.mean()) for image in (a, b)]
    correlation = np.fft.irfft2(np.conj(spectra[0]) * spectra[1], a.shape)
    y, x = (int(index) for index in np.unravel_index(int(correlation.argmax()), a.shape))
    height, width = a.shape
    return x - width * (x > width // 2), y - height * (y > height // 2)


def _brightest_window(image: _Image) -> tuple[slice, slice]:
    """Return rows and columns around the brightest pixel, where a shift is best seen."""
    y, x = np.unravel_index(int(image.sum(axis=2).argmax()), image.shape[:2])
    found = []
    for place, side in zip((int(y), int(x)), image.shape[:2], strict=True):
        start = min(max(place - _WINDOW // 2, 0), max(side - _WINDOW, 0))
        found.append(slice(start, start + _WINDOW))
    return found[0], found[1]


def _refined(a: _Image, b: _Image, window: tuple[slice, slice], start: tuple[int, int]) -> _Shift:
    """Return the shift to a part of a pixel: least squares of b(x) - a(x - shift) (Gauss-Newton).

    Source: Lucas and Kanade, "An Iterative Image Registration Technique with an Application to
    Stereo Vision", IJCAI 1981.
    """
    shift = np.array(start, np.float64)
    margin = int(np.abs(shift).max()) + 2
    reach = tuple(slice(max(part.start - margin, 0), part.stop + margin) for part in window)
    part_a, part_b = a[reach], b[reach]
    inner = _inner(part_a.shape, (margin - 2, margin - 2))
    if min(part_a.shape[:2]) <= 2 * margin + 2:
        return float(start[0]), float(start[1])
    for _ in range(20):
        moved = _moved(part_a, (float(shift[0]), float(shift[1])))
        slopes = np.stack(
            [np.asarray(np.gradient(moved, axis=axis))[inner].ravel() for axis in (1, 0)]
        )
        normal = slopes @ slopes.T
        if np.linalg.det(normal) <= 1e-12 * np.trace(normal) ** 2:
            break
        # A shift to the right lowers the values where they rise to the right.
        change = -np.linalg.solve(normal, slopes @ (part_b - moved)[inner].ravel())
        shift += np.clip(change, -0.5, 0.5)
        if np.abs(change).max() < 1e-4 or np.abs(shift - start).max() > 1.5:
            break
    return float(shift[0]), float(shift[1])


def _linear(part: float) -> tuple[float, ...]:
    return 0.0, 1 - part, part, 0.0


def _catmull_rom(part: float) -> tuple[float, ...]:
    """Source: Catmull and Rom, "A Class of Local Interpolating Splines", 1974."""
    t = part
    return (
        (-t + 2 * t**2 - t**3) / 2,
        (2 - 5 * t**2 + 3 * t**3) / 2,
        (t + 4 * t**2 - 3 * t**3) / 2,
        (-(t**2) + t**3) / 2,
    )


def _moved(
    image: _Image, shift: _Shift, taps: Callable[[float], tuple[float, ...]] = _linear
) -> _Image:
    """Return an image moved by (x, y) pixels with four taps an axis; edges wrap."""
    for axis, value in ((1, shift[0]), (0, shift[1])):
        whole = int(np.floor(value))
        weights = enumerate(taps(value - whole), whole - 1)
        moved = [weight * np.roll(image, place, axis) for place, weight in weights if weight]
        image = np.sum(moved, axis=0)
    return image


def _filtered(image: _Image, shift: _Shift, *, is_spline: bool) -> _Image:
    """Return an image moved with cubic splines, whose edges are mirrored, or with sinc functions.

    Source: Unser, "Splines: A Perfect Fit for Signal and Image Processing", IEEE Signal Processing
    Magazine 16 (1999).
    """
    height, width = image.shape[:2]
    padding = min(_PADDING, height, width) if is_spline else 0
    margins = ((padding, padding), (padding, padding), (0, 0))
    padded = np.pad(image, margins, mode="symmetric")
    spectrum = np.fft.rfft2(padded, axes=(0, 1))
    down = 2 * np.pi * np.fft.fftfreq(padded.shape[0])[:, np.newaxis, np.newaxis]
    across = 2 * np.pi * np.fft.rfftfreq(padded.shape[1])[:, np.newaxis]
    for frequency, value in ((across, shift[0]), (down, shift[1])):
        spectrum = spectrum * (
            _spline(frequency, value) if is_spline else np.exp(-1j * frequency * value)
        )
    moved: _Image = np.fft.irfft2(spectrum, padded.shape[:2], axes=(0, 1))
    return moved[padding : padding + height, padding : padding + width]


def _spline(frequency: NDArray[np.floating[Any]], shift: float) -> NDArray[np.complex128]:
    """Return the transfer function of a shift with interpolating cubic splines."""
    whole = int(np.floor(shift))
    part = shift - whole
    # The cubic B-spline at the distances 1 + part, part, 1 - part and 2 - part.
    weights = (
        (1 - part) ** 3 / 6,
        2 / 3 - part**2 + part**3 / 2,
        2 / 3 - (1 - part) ** 2 + (1 - part) ** 3 / 2,
        part**3 / 6,
    )
    taps = enumerate(weights, whole - 1)
    total: NDArray[np.complex128] = sum(
        (weight * np.exp(-1j * frequency * place) for place, weight in taps),
        np.zeros(1, np.complex128),
    )
    transfer: NDArray[np.complex128] = total / ((2 + np.cos(frequency)) / 3)
    return transfer


def _inner(shape: tuple[int, ...], shift: _Shift) -> tuple[slice, slice]:
    """Return the rows and columns that a shift does not bring in from outside the image."""
    x, y = (
        min(int(abs(value)) + 2, side // 3) for value, side in zip(shift, shape[1::-1], strict=True)
    )
    return slice(y, shape[0] - y), slice(x, shape[1] - x)


def _rms(values: NDArray[Any]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0
