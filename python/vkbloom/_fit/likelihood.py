"""How well a picture determines the fields that a fit has varied."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._fit.losses import Measure, reduce
from vkbloom._fit.space import Point, Space
from vkbloom._locks import cached_property

Array = NDArray[np.float64]
#: The standard deviation of a target's values, (), (H, W) or (H, W, 3), in its units.
Noise = float | NDArray[np.float64]

# Larger images are reduced by boxes, as in the search.
_MAX_PIXELS: Final = 2**16
# Steps of differences by coordinate: the first, the least and the largest.
_STEP: Final = 1e-3
_MIN_STEP: Final = 2e-4
_MAX_STEP: Final = 0.05
# Directions whose share of the Jacobian's square is less are without effect: single floats round.
_SINGULAR: Final = 1e-7
#: Coordinates are from EDGE to 1 - EDGE: at an end itself a method may change, as at a knee of 0.
EDGE: Final = 1e-6
# A sum of squares that is far below that of rounding.
_MIN_SQUARE: Final = 1e-40
# A minimum is reached where a step would lower the loss by less than this share of the variance.
_REACHED: Final = 1e-3
_MAX_STEPS: Final = 25
# Correlations of neighbours that are as many standard deviations from 0 are no chance.
_CORRELATED: Final = 5.0
# Residuals further apart do not count as correlated.
_MAX_LAG: Final = 24


@dataclass(frozen=True, eq=False)
class Optimum:
    """The point with the least sum of squares.

    - `residual`: Differences in units of the loss, (N,).
    - `jacobian`: Their derivatives by the coordinates of the numbers, (N, number of fields).
    - `covariance`: Of the coordinates of the numbers, where rounding leaves something to invert.
    - `inverse`: The same for a variance of 1.
    """

    point: Point
    residual: Array
    jacobian: Array
    inverse: Array
    covariance: Array

    @property
    def square(self) -> float:
        """The sum of squares."""
        return float(self.residual @ self.residual)


def variance_of(residual: Array, count: int) -> float:
    """Return the variance of differences that are as many numbers; above 0, also if all are 0."""
    return max(float(residual @ residual), _MIN_SQUARE) / count


@dataclass(eq=False)
class Likelihood:
    """The sum of squares around what a fit found, and the noise that makes it a likelihood.

    The noise of the target's values is independent and normal, with the standard deviation `noise`.
    None: that of the residuals, which may be correlated over short distances, or that of rounding
    to 8 bits where it is larger.
    """

    space: Space
    measure: Measure
    render: Callable[[Any], Array]
    found: Point
    noise: Noise | None

    @cached_property
    def _factor(self) -> int:
        height, width = self.measure.target.shape[:2]
        return max(1, math.ceil(math.sqrt(height * width / _MAX_PIXELS)))

    @cached_property
    def _small(self) -> Measure:
        """The measure of what is compared."""
        floats = self.measure.in_floats()
        if self.noise is None and self._is_exact():
            # Where a bloom is less than half a level, or does not change over an area, the errors
            # of rounding are not independent. The search has rounded alike: what it has found is
            # the optimum.
            found = self.render(self.space.settings(self.found))
            floats = dataclasses.replace(floats, target=floats.as_target(found))
        return floats if self._factor == 1 else floats.reduce(self._factor)

    def _is_exact(self) -> bool:
        """Return whether what was found has the levels of a target of 8 bits, but for few."""
        deviations = self.measure.level_deviations()
        if deviations is None:
            return False
        rounded = self.measure.as_target(self.render(self.space.settings(self.found)))
        return float(np.sum((rounded - self.measure.target) ** 2)) <= float(np.sum(deviations**2))

    def residual(self, point: Point) -> Array:
        """Return the differences at a point, as one row."""
        return self._differences(point).ravel()

    def _differences(self, point: Point) -> Array:
        array = self.render(self.space.settings(point))
        small = self._small
        result: Array = small.differences(reduce(array, self._factor))
        return result

    @cached_property
    def numbers(self) -> NDArray[np.intp]:
        """Indices of the continuous fields."""
        return np.flatnonzero(self.space.is_number)

    @cached_property
    def optimum(self) -> Optimum:
        """The point with the least sum of squares near the one that was found."""
        return self.optimum_near(self.found)

    def optimum_near(self, point: Point) -> Optimum:
        """Return the optimum near a point."""
        point = point.copy()
        point[self.numbers] = np.clip(point[self.numbers], EDGE, 1 - EDGE)
        residual = self.residual(point)
        jacobian = self.jacobian(point, residual, self.numbers)
        point, residual = self.minimize(point, residual, self.numbers, jacobian)
        jacobian = self.jacobian(point, residual, self.numbers)
        inverse, scaled = invert(jacobian[:, self.numbers])
        covariance = self._covariance(residual, jacobian[:, self.numbers], inverse, scaled)
        return Optimum(point, residual, jacobian, inverse, covariance)

    def jacobian(self, point: Point, residual: Array, fields: NDArray[np.intp]) -> Array:
        """Return the derivatives by some coordinates, by central differences.

        The steps are about one standard deviation of the field: so far the result is used.
        """
        result = np.zeros((residual.size, len(point)))
        deviation = math.sqrt(float(residual @ residual) / max(residual.size, 1))
        for index in fields:
            step = _STEP
            for _ in range(2):
                column = self._difference(point, residual, index, step)
                norm = float(np.linalg.norm(column))
                wanted = _MAX_STEP if norm == 0 else deviation / norm
                wanted = min(max(wanted, _MIN_STEP), _MAX_STEP)
                if 0.3 < wanted / step < 3:
                    break
                step = wanted
            result[:, index] = column
        return result

    def _difference(self, point: Point, residual: Array, index: int, step: float) -> Array:
        """Return the slope over a step to both sides, to one at an end."""
        ends = []
        for sign in (1, -1):
            moved = point.copy()
            moved[index] = min(max(point[index] + sign * step, EDGE), 1 - EDGE)
            at = residual if moved[index] == point[index] else self.residual(moved)
            ends.append((moved[index], at))
        (high, above), (low, below) = ends
        slope: Array = (above - below) / (high - low)
        return slope

    def minimize(
        self, point: Point, residual: Array, fields: NDArray[np.intp], jacobian: Array
    ) -> tuple[Point, Array]:
        """Return the point with the least sum of squares over some coordinates, and its residual.

        Gauss and Newton's steps, with Broyden's updates of the derivatives: Nocedal and Wright,
        "Numerical Optimization", 2006, chapters 10 and 11.
        """
        jacobian, is_fresh, share = jacobian[:, fields].copy(), False, 1.0
        enough = _REACHED * float(residual @ residual) / max(residual.size, 1)
        for _ in range(_MAX_STEPS if len(fields) else 0):
            step = share * _step(jacobian, residual, point[fields])
            ahead = point.copy()
            ahead[fields] = np.clip(point[fields] + step, EDGE, 1 - EDGE)
            step = ahead[fields] - point[fields]
            square = float(residual @ residual)
            expected = residual + jacobian @ step
            if square - float(expected @ expected) < enough:
                break
            reached = self.residual(ahead)
            if step @ step > 0:
                jacobian += np.outer((reached - expected) / (step @ step), step)
            if float(reached @ reached) < square:
                point, residual, share = ahead, reached, min(1.0, 2 * share)
            elif not is_fresh:
                jacobian, is_fresh = self.jacobian(point, residual, fields)[:, fields], True
            else:
                share /= 4
                if share < 1e-3:
                    break
        return point, residual

    def _covariance(self, residual: Array, jacobian: Array, inverse: Array, scaled: Array) -> Array:
        """Return the covariance of the coordinates of numbers, (n, n).

        With the residuals' covariance C it is A' C A, where A is the Jacobian times the inverse of
        its square: White, "Maximum Likelihood Estimation of Misspecified Models", Econometrica
        50(1), 1982.
        """
        scales = self._small.scales(self._array_of(residual)).ravel()
        count = max(np.count_nonzero(scales) - jacobian.shape[1], 1)
        estimated = variance_of(residual, count)
        variances = self._variances(scales)
        if variances is not None and (
            self.noise is not None or variances.sum() >= estimated * count
        ):
            return np.asarray(scaled.T @ (variances[:, np.newaxis] * scaled))
        wider: Array = estimated * inverse * self._excess(residual, scaled, inverse)
        return wider

    def _array_of(self, residual: Array) -> Array:
        """Return the picture that has some differences."""
        target = self._small.target
        if self._small.loss == "log":
            return np.asarray(
                target * 10 ** (residual.reshape(target.shape) * math.sqrt(target.size))
            )
        return np.asarray(target + residual.reshape(target.shape) * _unit(self._small))

    def _variances(self, scales: Array) -> Array | None:
        """Return the variance of each difference by the noise that is given, or by 8 bits."""
        given = self.measure.level_deviations() if self.noise is None else self.noise
        if given is None:
            return None
        deviations = np.asarray(given, np.float64)
        if deviations.ndim == 2:
            deviations = deviations[:, :, np.newaxis]
        whole = np.broadcast_to(deviations**2, self.measure.target.shape)
        # The variance of a mean of a box.
        return np.asarray(scales**2 * reduce(whole, self._factor).ravel() / self._factor**2)

    def _excess(self, residual: Array, scaled: Array, inverse: Array) -> Array:
        """Return by how much correlated residuals enlarge the covariance, (n, n), 1 for others.

        The residuals' covariance is taken to depend on the distance alone, with a window of Parzen
        to `_MAX_LAG`: Priestley, "Spectral Analysis and Time Series", 1981, chapter 6.
        """
        shape = self._small.target.shape
        values = residual.reshape(shape)
        if not _is_correlated(values):
            return np.ones_like(inverse)
        lags = [min(_MAX_LAG, side // 4) for side in shape[:2]]
        sides = [side + lag for side, lag in zip(shape, lags, strict=False)]
        parts = np.fft.rfft2(values, sides, axes=(0, 1))
        products = np.einsum("yxc,yxd->yxcd", parts.conj(), parts)
        window = np.outer(*(_parzen(side, lag) for side, lag in zip(sides, lags, strict=True)))
        together = np.fft.irfft2(products, sides, axes=(0, 1)) * window[..., np.newaxis, np.newaxis]
        spectrum = np.fft.rfft2(together, axes=(0, 1)) / (shape[0] * shape[1])
        weights = np.stack(
            [np.fft.rfft2(one.reshape(shape), sides, axes=(0, 1)) for one in scaled.T]
        )
        # Columns of half a spectrum stand for two, but for the first and, of even sides, the last.
        twice = np.full(spectrum.shape[1], 2.0)
        twice[0] = 1
        if sides[1] % 2 == 0:
            twice[-1] = 1
        parts = np.einsum("iyxc,yxcd->iyxd", weights, spectrum)
        sums = np.einsum("iyxd,iyxd,x->i", parts, weights.conj(), twice).real
        sums /= sides[0] * sides[1]
        plain = float(residual @ residual) / residual.size * np.diag(inverse)
        growth = np.sqrt(np.maximum(sums / np.maximum(plain, 1e-300), 1.0))
        return np.outer(growth, growth)

    def freedom(self) -> float:
        """Return the degrees of freedom of the noise: infinite where it is given."""
        return math.inf if self.noise is not None else max(self._small.target.size - 1, 1)

    def move(self, point: Point) -> None:
        """Take another optimum, near a point with a smaller loss."""
        self.optimum = self.optimum_near(point)


def _step(jacobian: Array, residual: Array, at: Point) -> Array:
    """Return Gauss and Newton's step; coordinates at an end that would leave it stay."""
    step = np.zeros(len(at))
    free = np.ones(len(at), np.bool_)
    for _ in range(len(at)):
        part = jacobian[:, free]
        slope = part.T @ residual
        step[:] = 0
        step[free] = -invert(part)[0] @ slope
        leaves = free & (((at <= EDGE) & (step < 0)) | ((at >= 1 - EDGE) & (step > 0)))
        if not leaves.any():
            break
        free &= ~leaves
    return step


def invert(jacobian: Array) -> tuple[Array, Array]:
    """Return the inverse of the Jacobian's square, and the Jacobian times it.

    Directions that have no effect have a variance of 0 there.
    """
    norms = np.linalg.norm(jacobian, axis=0)
    norms = np.where(norms > 0, norms, np.inf)
    unit = jacobian / norms
    inverse = np.linalg.pinv(unit.T @ unit, rcond=_SINGULAR, hermitian=True) / np.outer(
        norms, norms
    )
    return inverse, jacobian @ inverse


def _unit(measure: Measure) -> float:
    """Return what a difference of 1 is in units of the target."""
    if measure.loss == "relative":
        return float(np.linalg.norm(measure.target))
    return math.sqrt(measure.target.size)


def _is_correlated(values: Array) -> bool:
    """Return whether neighbouring differences, or those of channels, are correlated."""
    square = float(np.vdot(values, values))
    if square == 0:
        return False
    pairs = (
        (values[1:], values[:-1]),
        (values[:, 1:], values[:, :-1]),
        (values[..., 1:], values[..., :-1]),
    )
    return any(
        abs(float(np.vdot(a, b))) / square > _CORRELATED / math.sqrt(a.size) for a, b in pairs
    )


def _parzen(side: int, lag: int) -> Array:
    """Return Parzen's window over distances on a circle of pixels."""
    places = np.arange(side)
    share = np.minimum(places, side - places) / max(lag, 1)
    near, far = 1 - 6 * share**2 + 6 * share**3, 2 * np.maximum(1 - share, 0) ** 3
    return np.asarray(np.where(share <= 0.5, near, far))
