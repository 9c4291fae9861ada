"""Measures whether a bloom depends on the resolution."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom.testing._moving_light import moments, sample_area
from vkbloom.testing._probe import Bloom, Image, Probe

__tracebackhide__ = True

_DEFAULT = Probe(size=(128, 128))
_SCALES: Final = (0.5, 1.0, 2.0, 4.0)
# Rings that the light is sorted into, for each pixel of distance, and pixels of the shorter side.
_RINGS: Final = 4
_FINE: Final = 512


@public("vkbloom.testing")
@dataclass(frozen=True, eq=False, kw_only=True)
class ResolutionResponse:
    """Figures of the bloom of one scene at several sizes.

    All figures are computed from the first channel, after the bloom of a black image is subtracted.

    Parameters
    ----------
    sizes : tuple of (int, int)
        The N widths and heights in pixels.
    r50, r90 : ndarray of float64, shape (N,)
        Radius around the centroid that has 50 % and 90 % of the bloom's light, as a share of the
        height; NaN without light.
    peak : ndarray of float64, shape (N,)
        The largest value of the bloom relative to the value of the light.
    errors : mapping of str to ndarray of float64, shape (N,)
        Of a program that writes integers, the errors of r50, r90 and peak by the levels of values;
        otherwise empty.
    """

    sizes: tuple[tuple[int, int], ...]
    r50: NDArray[np.float64]
    r90: NDArray[np.float64]
    peak: NDArray[np.float64]
    errors: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


@public("vkbloom.testing")
@check_arguments
def resolution_response(
    bloom: Bloom,
    scales: Sequence[float] = _SCALES,
    *,
    light: float = 1 / 32,
    probe: Probe = _DEFAULT,
) -> ResolutionResponse:
    """Measure the bloom of one scene at several sizes.

    The scene is a bright square in the middle of a black image. It is area-sampled: each image
    is the exact box-filtered reduction of the larger ones, also by factors that are not integers.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns the bloom alone, of the same height and width.
    scales : sequence of float
        The sizes of the images, as factors of the probe's; both sides must become integers.
    light : float
        Side of the square, as a share of the height, above 0 to 1.
    probe : Probe
        The kind of image; `value` is the brightness of the square.

    Returns
    -------
    ResolutionResponse
    """
    check_number("light", light, math.ulp(0.0), 1.0)
    sizes = _sizes(scales, probe.size)
    rows, errors = [], []
    for width, height in sizes:
        sized = dataclasses.replace(probe, size=(width, height))
        side = light * height
        share = sample_area(sized.size, ((width - 1) / 2, (height - 1) / 2), (side, side))
        scene = probe.value * np.repeat(share[:, :, np.newaxis], sized.colours, axis=2)
        result, error = sized.apply(bloom, scene)
        lit = result[:, :, 0] - sized.apply(bloom, sized.flat(0.0))[0][:, :, 0]
        rows.append(_figures(lit, probe.value))
        if probe.is_coarse:
            half = np.broadcast_to(error, result.shape)[:, :, 0] / 2
            rounded = [_figures(lit + by * half * (lit > half), probe.value) for by in (-1, 1)]
            errors.append(np.abs(np.subtract(rounded, rows[-1])).max(axis=0))
    r50, r90, peak = np.array(rows).T
    names = ("r50", "r90", "peak")
    off = dict(zip(names, np.array(errors).T, strict=True)) if errors else {}
    return ResolutionResponse(sizes=sizes, r50=r50, r90=r90, peak=peak, errors=off)


def _figures(lit: Image, value: float) -> tuple[float, float, float]:
    """Return both radii as shares of the height, and the peak as a share of the light's value."""
    r50, r90 = (radius / len(lit) for radius in _radii(lit, (0.5, 0.9)))
    return r50, r90, float(lit.max()) / value


def _sizes(scales: Sequence[float], size: tuple[int, int]) -> tuple[tuple[int, int], ...]:
    if not len(scales):
        raise ValueError("scales: the sequence is empty; give at least one scale")
    results = []
    for scale in scales:
        check_number("scales", scale, 1e-3, 1e3)
        width, height = (float(side * scale) for side in size)
        if not (width.is_integer() and height.is_integer() and min(width, height) >= 1):
            raise ValueError(
                f"scales: {scale!r} makes {width:g} x {height:g} of an image of {_format(size)}, "
                "not integers; choose a scale or a size with integer sides"
            )
        results.append((int(width), int(height)))
    return tuple(results)


def _radii(plane: Image, shares: Sequence[float]) -> list[float]:
    """Return the radii around the centroid that have shares of the light; NaN without light."""
    total = float(plane.sum())
    if not total > 0:
        return [math.nan] * len(shares)
    # The light is spread over the area of a pixel. This matters if there are few pixels.
    fine = -(-_FINE // min(plane.shape))
    plane = plane.repeat(fine, axis=0).repeat(fine, axis=1)
    total *= fine**2
    height, width = plane.shape
    _, (x, y), _ = moments(plane)
    distance = np.hypot(np.arange(width) - x, (np.arange(height) - y)[:, np.newaxis])
    rings = np.bincount((distance * _RINGS).astype(np.intp).ravel(), plane.ravel())
    held = np.cumsum(rings) / total
    return [float((np.argmax(held >= share) + 1) / _RINGS / fine) for share in shares]


def _format(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"
