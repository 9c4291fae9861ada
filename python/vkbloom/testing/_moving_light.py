"""Measures the bloom of a light that moves by fractions of a pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_index, check_number
from vkbloom._public import public
from vkbloom.testing._point_spread import border_share
from vkbloom.testing._probe import Bloom, Image, Probe, call

__tracebackhide__ = True

# Side of the light in pixels.
_LIGHT: Final = 0.5
# A bloom with less than this share of the light of the brightest bloom has no centroid or radius.
_DIM: Final = 1e-3


@public("vkbloom.testing")
@dataclass(frozen=True, eq=False, kw_only=True)
class Stability:
    """Figures of the bloom of a light that moves along x, along y and along both.

    There are 3 paths of N positions each. All figures are computed from the first channel, after
    the bloom of a black image is subtracted.

    Parameters
    ----------
    positions : ndarray of float64, shape (3, N, 2)
        x and y of the light in pixels; the centre of the first pixel is (0, 0).
    energy : ndarray of float64, shape (3, N)
        Sum of the bloom.
    shift : ndarray of float64, shape (3, N, 2)
        Centroid of the bloom minus the centroid of the input image, in pixels; NaN without light.
    peak : ndarray of float64, shape (3, N)
        The largest value of the bloom.
    ideal : ndarray of float64, shape (3, N)
        The peak that a convolution has which spreads a lit pixel as the bloom does. It changes with
        the light's shares of the pixels, and so does the peak of every bloom. 1 where the bloom of
        a lit pixel is black.
    radius : ndarray of float64, shape (3, N)
        Root mean square distance of the bloom's light from its centroid, in pixels. The variance of
        the input image changes with the position of the light inside its pixel. Therefore it is
        replaced by the variance of the square light. NaN without light, or if the variance of the
        bloom is negative.
    at_border : float
        The largest share of the light in the outermost pixels. If it is not small, the image cuts
        off light, and the other figures apply only to the light inside the image.
    """

    positions: NDArray[np.float64]
    energy: NDArray[np.float64]
    shift: NDArray[np.float64]
    peak: NDArray[np.float64]
    ideal: NDArray[np.float64]
    radius: NDArray[np.float64]
    at_border: float

    @property
    def ripple(self) -> float:
        """(largest - smallest energy) / mean energy; NaN without light."""
        return _variation(self.energy)

    @property
    def jitter(self) -> float:
        """Largest distance between the centroids of bloom and image, in pixels."""
        return _largest(np.hypot(self.shift[..., 0], self.shift[..., 1]))

    @property
    def flicker(self) -> float:
        """(largest - smallest peak) / mean peak; NaN without light."""
        return _variation(self.peak)

    @property
    def shimmer(self) -> float:
        """The same of the peak divided by `ideal`: what of the flicker the bloom itself adds."""
        return _variation(self.peak / self.ideal)

    @property
    def growth(self) -> float:
        """(largest - smallest radius) / mean radius."""
        return _variation(self.radius)


@public("vkbloom.testing")
@check_arguments
def stability(
    bloom: Bloom,
    *,
    texel: int = 8,
    steps: float = 8,
    probe: Probe | None = None,
) -> Stability:
    """Measure how much the bloom of a small moving light changes.

    The light is a square of half a pixel. It is area-sampled: each pixel gets the share of the
    light that it covers, so all images have the same energy. The light moves over one texel of the
    coarsest level along x, along y and along both. If the bloom is a convolution, its energy and
    its radius are constant, and its centroid is that of the image. The peak then changes only
    because the light is distributed over the pixels in different shares.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns the bloom alone, of the same height and width.
    texel : int
        Length of each path in pixels, at least 1: the size of a texel of the coarsest level. For a
        chain of N halvings this is 2^N.
    steps : float
        Positions for each pixel of a path, above 0.
    probe : Probe, optional
        The kind of image; its `value` is the light's sum over all pixels. For a method with a
        threshold, it must be large, because a pixel may get only a quarter of the light or less.
        Default: 16 texels wide and high, at least 64 pixels.

    Returns
    -------
    Stability
        With the figures `ripple` of the energy, `jitter` of the centroid, `flicker` and `shimmer`
        of the peak, and `growth` of the radius.
    """
    check_index("texel", texel, 1, 4096)
    check_number("steps", steps, 1e-3, 1e3)
    probe = probe or _wide(texel)
    if texel + 2 > min(probe.size):
        raise ValueError(f"probe: a path of {texel} pixels leaves an image of {probe.size}")
    along = (np.arange(max(1, round(texel * steps))) + 0.5) / max(1, round(texel * steps)) - 0.5
    middle = (np.array(probe.size) - 1) / 2
    positions = np.stack(
        [
            middle + texel * along[:, np.newaxis] * np.array(direction)
            for direction in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))
        ]
    )
    dark = probe.apply(bloom, probe.flat(0.0))[0][:, :, 0]
    lit = probe.apply(bloom, probe.point(probe.centre, probe.value))[0][:, :, 0]
    spread = (lit - dark) / probe.value
    rows = []
    for position in positions.reshape(-1, 2):
        given = _light(probe, position)
        result = probe.values(call(bloom, given), given)[0][:, :, 0]
        rows.append(_figures(result - dark, probe, given, spread))
    energy, across, down, peak, ideal, radius, border = np.array(rows).T.reshape(
        -1, *positions.shape[:2]
    )
    faint = ~(energy > _DIM * energy.max())
    shift = np.where(faint[..., np.newaxis], math.nan, np.stack([across, down], axis=-1))
    return Stability(
        positions=positions,
        energy=energy,
        shift=shift,
        peak=peak,
        ideal=ideal,
        radius=np.where(faint, math.nan, radius),
        at_border=float(border.max()),
    )


def sample_area(
    size: tuple[int, int], centre: tuple[float, float], sides: tuple[float, float]
) -> Image:
    """Return the share of each pixel that a rectangle covers."""
    covered = []
    for count, position, side in zip(size, centre, sides, strict=True):
        edges = np.arange(count + 1) - 0.5
        covered.append(np.diff(np.clip(edges, position - side / 2, position + side / 2)))
    return np.outer(covered[1], covered[0])


def _wide(texel: int) -> Probe:
    side = max(64, 16 * texel)
    return Probe(size=(side, side))


def _light(probe: Probe, position: NDArray[np.float64]) -> NDArray[Any]:
    """Return the image of the light in the probe's dtype."""
    share = sample_area(probe.size, (position[0], position[1]), (_LIGHT, _LIGHT)) / _LIGHT**2
    return probe.as_input(probe.value * np.repeat(share[:, :, np.newaxis], probe.colours, axis=2))


def _convolution_peak(spread: Image, image: Image) -> float:
    """Return the largest value of the convolution of a plane with a light; 1 if it is black."""
    lit = np.argwhere(image)
    # (Where the peak lies does not matter.)
    parts = [image[y, x] * np.roll(spread, (y, x) - lit[0], (0, 1)) for y, x in lit]
    peak = float(np.sum(parts, axis=0).max())
    return peak if peak > 0 else 1.0


def _figures(bloom: Image, probe: Probe, given: NDArray[Any], spread: Image) -> tuple[float, ...]:
    """Return energy, x and y of the shift, peak, ideal, radius, and the share at the border."""
    image = probe.values_of(given)[:, :, 0]
    energy, position, variance = moments(bloom)
    _, from_place, from_variance = moments(image)
    # Replace the variance of the sampled light by that of the square.
    left = variance - from_variance + _LIGHT**2 / 6
    return (
        energy,
        position[0] - from_place[0],
        position[1] - from_place[1],
        float(bloom.max()),
        _convolution_peak(spread, image),
        math.sqrt(left) if left >= 0 else math.nan,
        border_share(bloom),
    )


def moments(plane: Image) -> tuple[float, tuple[float, float], float]:
    """Return sum, centroid (x, y) and variance; the latter are NaN without light."""
    total = float(plane.sum())
    if total == 0:
        return total, (math.nan, math.nan), math.nan
    centroid, variance = [], 0.0
    for axis in (0, 1):
        profile = plane.sum(axis=axis) / total
        distance = np.arange(len(profile), dtype=np.float64)
        middle = float(profile @ distance)
        centroid.append(middle)
        variance += float(profile @ (distance - middle) ** 2)
    return total, (centroid[0], centroid[1]), variance


def _variation(values: NDArray[np.float64]) -> float:
    """Return (largest - smallest) / mean; NaN if the mean is not above 0."""
    known = values[np.isfinite(values)]
    if not (known.size and known.mean() > 0):
        return math.nan
    return float(np.ptp(known) / known.mean())


def _largest(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else math.nan
