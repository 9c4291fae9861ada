"""Point-spread functions that depend only on the distance, and their integrals."""

from __future__ import annotations

import abc
import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vkbloom._numbers import check_above, check_size
from vkbloom._psf.base import FRAME_DEGREES, PSF, Array, check_radii, in_grey

# (first distance in pixels, nodes along a side of a pixel). The outer parts are smooth and need
# few nodes. The inner parts may have a core or a halo that is narrower than a pixel.
_RINGS = ((0.0, 16), (24.0, 4), (96.0, 2))
# The centre pixel is divided into nine squares, the middle one of them again, and so on.
_LEVELS = 24
# Pixels per NumPy call: many, to make the calls' overhead small, but few enough for the cache.
_AT_ONCE = 1024
_DEGREE = math.pi / 180
# Of Bessel functions: the asymptotic series is exact to 1e-15 from here on, the integral below.
_FAR = 25.0
_NODES = 32
_TERMS = 9


def integrate_pixels(
    density: Callable[[Array], Array], size: tuple[int, int], period: float = math.inf
) -> Array:
    """Integrate a radial density over the pixels of an image."""
    width, height = check_size("size", size)
    # The quadrants are equal. This one is to the right of the point and below it.
    rows, columns = (np.arange(1 + side // 2, dtype=np.float64) for side in (height, width))
    y, x = np.meshgrid(rows, columns, indexing="ij")
    distance = np.hypot(x, y)
    centre = _centre(density)
    quadrant = np.empty((len(centre), *distance.shape))
    least = min(16, math.ceil(2 + 4 / period))
    ends = [ring[0] for ring in _RINGS[1:]] + [math.inf]
    for (start, count), end in zip(_RINGS, ends, strict=True):
        chosen = (distance >= start) & (distance < end)
        quadrant[:, chosen] = _product(density, x[chosen], y[chosen], 1.0, max(count, least))
    quadrant[:, 0, 0] = centre
    # An even side has one more pixel before the centre than after it.
    mirrored = [np.abs(np.arange(side) - side // 2) for side in (height, width)]
    return np.ascontiguousarray(np.moveaxis(quadrant[:, mirrored[0]][:, :, mirrored[1]], 0, -1))


def _product(
    density: Callable[[Array], Array], x: Array, y: Array, side: float, count: int
) -> Array:
    """Integrate over squares around (x, y) by the product rule of Gauss and Legendre."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    across, down = (part.ravel() for part in np.meshgrid(nodes, nodes))
    shares = np.outer(weights, weights).ravel() * side**2 / 4
    parts = []
    for start in range(0, max(1, len(x)), _AT_ONCE):
        chunk = slice(start, start + _AT_ONCE)
        distance = np.hypot(
            x[chunk] + across[:, np.newaxis] * side / 2, y[chunk] + down[:, np.newaxis] * side / 2
        )
        parts.append(np.einsum("k,ckn->cn", shares, density(distance)))
    return np.concatenate(parts, axis=1)


def _centre(density: Callable[[Array], Array]) -> Array:
    """Integrate over the centre pixel, by rings of squares that get smaller by thirds."""
    total: Array | float = 0.0
    for level in range(1, 1 + _LEVELS):
        side = 3.0**-level
        # Of the eight squares around the middle one, four lie on an axis and four on a diagonal.
        centres = np.array([side, side]), np.array([0.0, side])
        total = total + 4 * _product(density, *centres, side, 12).sum(axis=1)
    return np.asarray(total)


class RadialPSF(PSF):
    """A density per steradian that depends only on the angle."""

    unit = "degree"
    #: Largest step of the integration in degrees.
    finest: ClassVar[float] = 0.05

    @abc.abstractmethod
    def density(self, theta: ArrayLike) -> Array:
        """Return the energy per steradian.

        Parameters
        ----------
        theta : array-like of float
            Angles from the direction of the light in degrees, at least 0, of any shape.

        Returns
        -------
        ndarray of float64, shape (..., 3)
            Linear RGB.
        """

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        scale = max(check_size("size", size)) / FRAME_DEGREES
        if pixels_per_degree is not None:
            scale = check_above("pixels_per_degree", pixels_per_degree)

        def per_pixel(distance: Array) -> Array:
            theta = distance / scale
            # Pixels are equal steps of the angle. A ring on the sphere is shorter than the ring
            # of the same radius in a plane.
            ring = np.sinc(theta / 180) * (_DEGREE / scale) ** 2
            values = np.moveaxis(self.density(np.minimum(theta, 90)), -1, 0)
            # One channel of a grey density is computed for all three.
            values = values[:1] if values.strides[0] == 0 else values
            return values * np.where(theta <= 90, ring, 0)

        pixels = integrate_pixels(per_pixel, size)
        return in_grey(pixels[..., 0]) if pixels.shape[2] == 1 else pixels

    def energy(self) -> Array:
        return np.asarray(self.encircled_energy([90.0])[0])

    def encircled_energy(self, radii: ArrayLike) -> Array:
        ends = np.minimum(check_radii("radii", radii), 90.0)
        edges = np.unique(np.concatenate([_edges(self.finest), ends]))
        theta, weights = _nodes(edges)
        rings = (self._rings(theta) * weights[..., np.newaxis]).sum(axis=1)
        sums = np.concatenate([np.zeros((1, 3)), rings.cumsum(axis=0)])
        return np.asarray(sums[np.searchsorted(edges, ends)])

    def mtf(self, frequencies: ArrayLike) -> Array:
        cycles = check_radii("frequencies", frequencies)
        # Panels are at most half a period long.
        finest = min(self.finest, 0.5 / max(cycles.max(initial=0), 1.0))
        theta, weights = _nodes(_edges(finest))
        rings = (self._rings(theta) * weights[..., np.newaxis]).reshape(-1, 3)
        angles = 2 * math.pi * theta.ravel()
        transfer = np.stack([bessel(0, cycle * angles) @ rings for cycle in cycles])
        return np.asarray(np.abs(transfer) / rings.sum(axis=0))

    def _rings(self, theta: Array) -> Array:
        """Return the energy per degree of the radius."""
        length = 2 * math.pi * np.sin(theta * _DEGREE) * _DEGREE
        return self.density(theta) * length[..., np.newaxis]


def _edges(finest: float) -> Array:
    """Return panels of 0..90 degrees, with lengths in proportion to the angle, up to `finest`."""
    steps = np.arange(0, 90, finest)
    return np.unique(np.concatenate([[0.0], np.geomspace(1e-7, 90, 300), steps[1:]]))


def _nodes(edges: Array) -> tuple[Array, Array]:
    """Return the nodes and weights of each panel, as (panels, 8)."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = np.diff(edges)[:, np.newaxis] / 2
    return edges[:-1, np.newaxis] + half * (1 + nodes), half * weights


def bessel(order: int, x: Array) -> Array:
    """Return J_order(x), exact to 1e-14.

    For small x, J_n(x) is 1 / pi times the integral of cos(n t - x sin t) over 0..pi. The midpoint
    rule converges exponentially here, because the integrand is periodic. For large x, Hankel's
    asymptotic expansion is used (NIST Digital Library of Mathematical Functions, 10.9.2, 10.17.3).
    """
    result = np.empty_like(x)
    far = x >= _FAR
    result[~far] = _integral(order, x[~far])
    result[far] = _asymptotic(order, x[far])
    return result


def _integral(order: int, x: Array) -> Array:
    total = np.zeros_like(x)
    for angle in (np.arange(_NODES) + 0.5) * np.pi / _NODES:
        total += np.cos(order * angle - x * np.sin(angle))
    return total / _NODES


def _asymptotic(order: int, x: Array) -> Array:
    phase = x - order * np.pi / 2 - np.pi / 4
    even, odd = np.zeros_like(x), np.zeros_like(x)
    term = np.ones_like(x)
    for k in range(2 * _TERMS):
        sign = -1 if k // 2 % 2 else 1
        if k % 2:
            odd += sign * term
        else:
            even += sign * term
        term = term * (4 * order**2 - (2 * k + 1) ** 2) / ((k + 1) * 8 * x)
    wave: Array = np.cos(phase) * even - np.sin(phase) * odd
    return np.sqrt(2 / (np.pi * x)) * wave
