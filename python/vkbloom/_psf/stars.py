"""The star of a filter whose grooves spread lights into rays."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from vkbloom._array_cache import keep
from vkbloom._numbers import check_size
from vkbloom._psf.base import Array, check_radii, crop_or_pad, in_grey
from vkbloom._psf.sampled import SampledPSF
from vkbloom._public import public
from vkbloom._settings.fields import number_field, numbers_field

# The frame of the functions that are given none.
_FRAME: Final = 1024
# A ray has at least this standard deviation in pixels: a narrower one would have gaps.
_MIN_DEVIATION: Final = 0.5
# Standard deviations at which a ray is cut off.
_CUT: Final = 4.0


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class star(SampledPSF):
    """Rays of a star filter, whose lengths and widths are shares of the frame.

    A small light gets the same star in pictures of all sizes.

    Parameters
    ----------
    rays : int
        Number of rays, 1 to 32, at equal angles.
    angle : float
        Direction of the first ray in degrees, -360 to 360. 0: to the right; 90: down.
    length : float
        Length of a ray as a share of the frame's longer side, 0.001 to 1.
    width : float
        Standard deviation of the light across a ray as a share of the frame's longer side, 0 to
        0.1. A ray has at least half a pixel.
    tint : (float, float, float)
        Energy of red, green and blue.
    surround : float
        Share of the rays' mean around the point that is subtracted, 0 to 4. From about 1 on, the
        rays of large areas cancel out, and only small lights have rays. Values become negative,
        which the composite "screen" clamps to 0.

    Notes
    -----
    With the length L in pixels, the light along a ray falls as p(d) = 3 (1 - d / L)^2 / L, and
    across it as a Gaussian with the standard deviation s. The sum of all rays is 1. The surround is
    p(r) / sqrt(r^2 + s^2), divided by its sum. `array` is that of a frame of its size. `energy`,
    `encircled_energy` and `mtf` are those of a frame of 1024 pixels; `mtf` is divided by the energy
    of the rays.
    """

    rays: int = number_field(default=4, range=(1, 32))
    angle: float = number_field(default=0.0, range=(-360, 360), slider=(0, 90))
    length: float = number_field(default=0.15, range=(0.001, 1), slider=(0.01, 0.5))
    width: float = number_field(default=0.001, range=(0, 0.1), slider=(0, 0.01))
    tint: tuple[float, float, float] = numbers_field((1.0, 1.0, 1.0), 0, 1000, count=(3, 3))
    surround: float = number_field(default=0.0, range=(0, 4))

    def native_array(self) -> Array:
        return self.kernel((_FRAME, _FRAME))

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        return self.kernel(size, size)

    def mtf(self, frequencies: ArrayLike) -> Array:
        lines = _plane(self, (_FRAME, _FRAME)).sum(axis=0)
        positions = np.arange(len(lines)) - len(lines) // 2
        waves = np.exp(-2j * np.pi * np.outer(check_radii("frequencies", frequencies), positions))
        return in_grey(np.abs(waves @ lines))

    def default_size(self, frame: tuple[int, int]) -> tuple[int, int]:
        reach = math.ceil(self.length * max(frame) + _CUT * _deviation(self, frame))
        width, height = (min(2 * reach + 1, 2 * side - 1) for side in frame)
        return width, height

    def kernel(
        self,
        frame: tuple[int, int],
        size: tuple[int, int] | None = None,
        pixels_per_degree: float | None = None,
    ) -> Array:
        plane = _plane(self, check_size("frame", frame))
        return crop_or_pad(plane[..., np.newaxis] * self.tint, size or self.default_size(frame))


def _deviation(psf: star, frame: tuple[int, int]) -> float:
    return max(psf.width * max(frame), _MIN_DEVIATION)


@keep
def _plane(psf: star, frame: tuple[int, int]) -> Array:
    """Return the rays less their surround, without the tint."""
    width, height = psf.default_size(frame)
    length, deviation = psf.length * max(frame), _deviation(psf, frame)
    # Narrow rays are integrated over the pixels, wide ones sampled.
    count = math.ceil(2 / deviation)
    nodes, weights = np.polynomial.legendre.leggauss(count)
    rays, surround = np.zeros((height, width)), np.zeros((height, width))
    columns, rows = (np.arange(side) - float(side // 2) for side in (width, height))
    for down, row_weight in zip(nodes / 2, weights, strict=True):
        for across, weight in zip(nodes / 2, weights * row_weight, strict=True):
            x, y = columns + across, (rows + down)[:, np.newaxis]
            rays += weight * _rays(psf, x, y, length, deviation)
            if psf.surround:
                distance = np.hypot(x, y)
                surround += weight * _along(distance, length) / np.hypot(distance, deviation)
    plane: Array = rays / rays.sum()
    if psf.surround:
        plane -= psf.surround * surround / surround.sum()
    plane.flags.writeable = False
    return plane


def _rays(psf: star, x: Array, y: Array, length: float, deviation: float) -> Array:
    total: Array = np.zeros((y.shape[0], x.shape[0]))
    for index in range(psf.rays):
        angle = math.radians(psf.angle + 360 * index / psf.rays)
        along = x * math.cos(angle) + y * math.sin(angle)
        across = (x * math.sin(angle) - y * math.cos(angle)) / deviation
        near = (along > -_CUT * deviation) & (np.abs(across) < _CUT)
        # Behind the point, a ray ends as a Gaussian.
        behind = np.minimum(along[near], 0) / deviation
        total[near] += _along(np.maximum(along[near], 0), length) * np.exp(
            -(across[near] ** 2 + behind**2) / 2
        )
    return total


def _along(distance: Array, length: float) -> Array:
    """Return the light along a ray, or of a ring, up to a factor."""
    return np.asarray(np.maximum(1 - distance / length, 0) ** 2)
