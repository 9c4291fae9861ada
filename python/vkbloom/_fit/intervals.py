"""Intervals of fields, and combinations of fields that a picture does not determine."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._fit.likelihood import EDGE, Likelihood, Optimum, invert, variance_of
from vkbloom._fit.space import Point, VariedField
from vkbloom._locks import cached_property

Array = NDArray[np.float64]
Interval = tuple[float, float]

# The quadratic form holds if the profile at its ends is so close to it, as a share.
_CLOSE: Final = 0.05
# The ends of an interval are so exact, as a share of the profile's root.
_EXACT: Final = 0.02
_MAX_STEPS: Final = 30
# How much lower another place must be, in variances, to be the optimum.
_LOWER: Final = 0.01
# An exact fit has places that are lower by roundings everywhere: so often the optimum moves.
_MAX_MOVES: Final = 4
# Where the profile ends at less than such a share of the quadratic form's distance, it may fall
# again: so many places further out are looked at.
_STEEP: Final = 0.5
_MAX_PROBES: Final = 8
# A profile that rises by less than so many variances over such a part of the range has no end.
_FLAT: Final = 0.01
_PART: Final = 0.25
# A combination is not determined if such a change, as a share of the fields, costs less than so
# many variances.
_FREE: Final = 0.5
_NOTHING: Final = 0.1
# Jacobians whose smallest eigenvalue, of unit columns, is less have no inverse.
_SINGULAR: Final = 1e-6
# Fields with a smaller weight are no part of a combination.
_WEIGHT: Final = 0.05


class _LowerError(Exception):
    """A place has a smaller sum of squares than the optimum."""

    def __init__(self, point: Point) -> None:
        super().__init__()
        self.point = point


class Intervals:
    """Intervals of the fields of a likelihood, and their covariance."""

    def __init__(self, likelihood: Likelihood) -> None:
        self._likelihood = likelihood
        self._known: dict[tuple[str, float], Interval] = {}
        self._moves = 0

    @property
    def may_move(self) -> bool:
        """Whether a lower place than the optimum becomes it."""
        return self._moves < _MAX_MOVES

    @property
    def _axes(self) -> tuple[VariedField, ...]:
        return self._likelihood.space.axes

    def interval(self, name: str, level: float) -> Interval:
        """Return the ends of a field's interval; infinite ones are not determined."""
        index = self._index(name)
        if self.is_choice(name):
            raise ValueError(f"name: {name!r} is a flag or a choice, which has no interval")
        if any(name in group for group in self.combinations):
            return -math.inf, math.inf
        while (name, level) not in self._known:
            try:
                self._known[name, level] = self._find(index, level)
            except _LowerError as lower:
                self._moves += 1
                self._known.clear()
                self._likelihood.move(lower.point)
        return self._known[name, level]

    def is_choice(self, name: str) -> bool:
        """Return whether a field is a flag or a choice, which has no interval."""
        return self._axes[self._index(name)].kind == "choice"

    def _index(self, name: str) -> int:
        return [axis.name for axis in self._axes].index(name)

    @cached_property
    def combinations(self) -> tuple[dict[str, float], ...]:
        """Combinations of several fields that are not determined: the weights of each."""
        optimum = self._likelihood.optimum
        numbers = self._likelihood.numbers
        if len(numbers) < 2:
            return ()
        changes = np.array([self._change(index, optimum.point) for index in numbers])
        scaled = optimum.jacobian[:, numbers] * changes
        squares, directions = np.linalg.eigh(scaled.T @ scaled)
        variance = self._variance(optimum)
        found = []
        for square, direction in zip(squares, directions.T, strict=True):
            weights = direction / direction[np.argmax(np.abs(direction))]
            is_wide = square * _FREE**2 < _NOTHING * variance
            if (
                is_wide
                and np.count_nonzero(np.abs(weights) > _WEIGHT) > 1
                and self._is_free(weights)
            ):
                names = [self._axes[index].name for index in numbers]
                pairs = zip(names, weights, strict=True)
                found.append({name: round(float(w), 3) for name, w in pairs if abs(w) > _WEIGHT})
        return tuple(found)

    def _is_free(self, weights: Array) -> bool:
        """Return whether a change of some fields together has no effect to either side."""
        likelihood, numbers = self._likelihood, self._likelihood.numbers
        optimum = likelihood.optimum
        limit = optimum.square + _NOTHING * self._variance(optimum)
        values = self._values(optimum.point)
        for sign in (-_FREE, _FREE):
            point = optimum.point.copy()
            for index, weight in zip(numbers, weights, strict=True):
                axis, value = self._axes[index], values[index]
                if axis.is_relative and value > axis.low:
                    moved = value * math.exp(sign * weight)
                else:
                    moved = value + sign * weight * self._size(axis, value)
                point[index] = np.clip(axis.coordinate(moved), EDGE, 1 - EDGE)
            residual = likelihood.residual(point)
            # The others, and with them the ridge where it is bent.
            rest = numbers[np.abs(weights) < 1]
            _, residual = likelihood.minimize(point, residual, rest, optimum.jacobian)
            if float(residual @ residual) > limit:
                return False
        return True

    def _values(self, point: Point) -> list[Any]:
        return [axis.value(float(at)) for axis, at in zip(self._axes, point, strict=True)]

    def _size(self, axis: VariedField, value: float) -> float:
        """Return how large a change of a field is that is large."""
        if axis.is_relative and value > axis.low:
            return abs(value)
        return axis.scale if axis.scale is not None else axis.high - axis.low

    def _change(self, index: int, point: Point) -> float:
        """Return the coordinate's change of a large change of the field."""
        axis, at = self._axes[index], float(point[index])
        return self._size(axis, axis.value(at)) / axis.slope(at)

    def _variance(self, optimum: Optimum) -> float:
        """Return the mean variance of a difference."""
        inverse, covariance = np.diag(optimum.inverse), np.diag(optimum.covariance)
        known = inverse > 0
        if not known.any():
            return variance_of(optimum.residual, optimum.residual.size)
        return float(np.mean(covariance[known] / inverse[known]))

    def covariance(self) -> Array:
        """Return the covariance of the fields, NaN of those that are no numbers."""
        likelihood = self._likelihood
        free = {name for group in self.undetermined() for name in group}
        optimum, count = likelihood.optimum, len(self._axes)
        result = np.full((count, count), np.nan)
        slopes = [self._axes[i].slope(float(optimum.point[i])) for i in likelihood.numbers]
        result[np.ix_(likelihood.numbers, likelihood.numbers)] = optimum.covariance * np.outer(
            slopes, slopes
        )
        for index, axis in enumerate(self._axes):
            if axis.name in free:
                result[index] = result[:, index] = np.nan
                result[index, index] = np.inf
        return result

    def correlation(self) -> Array:
        """Return the correlation of the fields; 1 or -1 along what is not determined."""
        likelihood = self._likelihood
        optimum, numbers = likelihood.optimum, likelihood.numbers
        result = np.full((len(self._axes),) * 2, np.nan)
        norms = np.linalg.norm(optimum.jacobian[:, numbers], axis=0)
        unit = optimum.jacobian[:, numbers] / np.where(norms > 0, norms, 1.0)
        squares, directions = np.linalg.eigh(unit.T @ unit)
        covariance = optimum.covariance
        if squares.min(initial=1.0) < _SINGULAR:
            # The limit of a little knowledge of each field.
            covariance = (directions / np.maximum(squares, _SINGULAR**2)) @ directions.T
        deviations = np.sqrt(np.diag(covariance))
        result[np.ix_(numbers, numbers)] = covariance / np.outer(deviations, deviations)
        return result

    def undetermined(self) -> tuple[dict[str, float], ...]:
        """Return the combinations, and the fields whose interval has no end."""
        known = {name for group in self.combinations for name in group}
        single = [
            {self._axes[index].name: 1.0}
            for index in self._likelihood.numbers
            if self._axes[index].name not in known and self._is_loose(index)
        ]
        return (*self.combinations, *single)

    def _is_loose(self, index: int) -> bool:
        """Return whether a field's interval of 95 % has no end."""
        place = int(np.flatnonzero(self._likelihood.numbers == index)[0])
        optimum = self._likelihood.optimum
        change = self._change(index, optimum.point)
        deviation = math.sqrt(max(optimum.covariance[place, place], 0.0))
        # A standard deviation of 0 is that of a field without an effect.
        if 0 < deviation < _FREE * change / 2:
            return False
        return not all(map(math.isfinite, self.interval(self._axes[index].name, 0.95)))

    def _find(self, index: int, level: float) -> Interval:
        likelihood = self._likelihood
        axis = self._axes[index]
        stats = import_extra("scipy.stats", "fit", "An interval")
        limit = float(stats.t.ppf((1 + level) / 2, likelihood.freedom()))
        if axis.kind == "integer":
            ends = [self._integer_end(index, limit, sign) for sign in (-1, 1)]
            return ends[0], ends[1]
        optimum = likelihood.optimum
        at = float(optimum.point[index])
        place = int(np.flatnonzero(likelihood.numbers == index)[0])
        deviation = math.sqrt(max(float(optimum.covariance[place, place]), 0.0))
        slope, value = axis.slope(at), axis.value(at)
        quadratic = [value + sign * limit * deviation * slope for sign in (-1, 1)]
        sides = []
        for sign, end in zip((-1, 1), quadratic, strict=True):
            side = _Side(self, index, sign, limit)
            if deviation > 0 and axis.low < end < axis.high:
                side.visit(axis.coordinate(end))
            sides.append(side)
        if all(side.is_quadratic for side in sides):
            return quadratic[0], quadratic[1]
        low, high = (side.end() for side in sides)
        is_whole = low <= axis.low and high >= axis.high
        return (-math.inf, math.inf) if is_whole else (low, high)

    def _integer_end(self, index: int, limit: float, sign: int) -> float:
        """Return the last integer to one side that the picture allows."""
        axis, profile = self._axes[index], _Side(self, index, sign, limit)
        value = at = axis.value(float(self._likelihood.optimum.point[index]))
        while axis.low <= value + sign <= axis.high:
            if profile.visit(axis.coordinate(value + sign)) > limit:
                return float(value)
            value += sign
        # No end was met, or there is none to meet.
        return float(value) if value == at else sign * math.inf


class _Side:
    """The profile of one field to one side of the optimum.

    Its value at a coordinate is the root of how far the least sum of squares over the other fields
    is above that of the optimum, in variances. Where the sum is quadratic, it is proportional to
    the distance: Venzon and Moolgavkar, "A Method for Computing Profile-Likelihood-Based Confidence
    Intervals", Applied Statistics 37(1), 1988.
    """

    def __init__(self, intervals: Intervals, index: int, sign: int, limit: float) -> None:
        self._intervals, self._index, self._sign, self._limit = intervals, index, sign, limit
        likelihood = intervals._likelihood
        self._likelihood, self._optimum = likelihood, likelihood.optimum
        self._axis = likelihood.space.axes[index]
        self._begin = float(self._optimum.point[index])
        self._others = likelihood.numbers[likelihood.numbers != index]
        self._variance = self._variance_of_field()
        place = np.flatnonzero(likelihood.numbers == index)
        variances = np.diag(self._optimum.covariance)[place]
        self._deviation = math.sqrt(max(float(variances.sum()), 0.0))
        # Coordinate and profile, from the optimum on, and the point of the last.
        self._visited = [(self._begin, 0.0)]
        self._last = self._optimum.point

    def _variance_of_field(self) -> float:
        """Return the variance with which the sum of squares is that of the field's likelihood.

        Chandler and Bate, "Inference for Clustered Data Using the Independence Loglikelihood",
        Biometrika 94(1), 2007.
        """
        optimum, numbers = self._optimum, self._likelihood.numbers
        places = np.flatnonzero(numbers == self._index)
        if places.size and optimum.inverse[places[0], places[0]] > 0:
            place = places[0]
            return float(optimum.covariance[place, place] / optimum.inverse[place, place])
        return self._intervals._variance(optimum)

    def visit(self, coordinate: float) -> float:
        """Return the profile at a coordinate."""
        optimum = self._optimum
        point = self._last.copy()
        # Along the ridge of the quadratic form.
        distance = coordinate - point[self._index]
        jacobian = optimum.jacobian
        if self._others.size:
            slope = invert(jacobian[:, self._others])[1].T @ jacobian[:, self._index]
            moves = -slope * distance
            point[self._others] = np.clip(point[self._others] + moves, EDGE, 1 - EDGE)
        point[self._index] = coordinate
        residual = self._likelihood.residual(point)
        point, residual = self._likelihood.minimize(point, residual, self._others, jacobian)
        point, residual = self._without_bloom(point, residual)
        above = (float(residual @ residual) - optimum.square) / self._variance
        if above < -_LOWER and self._intervals.may_move:
            raise _LowerError(point)
        profile = math.sqrt(max(above, 0.0))
        self._visited.append((coordinate, profile))
        self._last = point
        return profile

    def _without_bloom(self, point: Point, residual: Array) -> tuple[Point, Array]:
        """Return a place, or that with a threshold above every pixel if it is better.

        No derivative leads there.
        """
        for index in self._others:
            is_above = float(residual @ residual) > self._optimum.square + self._variance
            if is_above and self._likelihood.space.axes[index].ends_with_picture:
                other = point.copy()
                other[index] = 1 - EDGE
                there = self._likelihood.residual(other)
                if there @ there < residual @ residual:
                    point, residual = other, there
        return point, residual

    @property
    def is_quadratic(self) -> bool:
        """Whether the profile at the end of the quadratic form is the limit."""
        return (
            len(self._visited) > 1 and abs(self._visited[1][1] - self._limit) < _CLOSE * self._limit
        )

    def end(self) -> float:
        """Return the last value at which the profile reaches the limit."""
        bound = EDGE if self._sign < 0 else 1 - EDGE
        inner, outer = self._bracket(bound)
        while outer is not None:
            value, crossed = self._cross(inner, outer)
            again = self._allowed_beyond(crossed, bound)
            if again is None:
                return value
            inner, outer = self._bracket(bound, again)
        return self._end_at(bound)

    def _allowed_beyond(self, crossed: float, bound: float) -> tuple[float, float] | None:
        """Return a place further out that the picture allows, too, where there may be one.

        At a kink or a step, such as that of a knee of 0, the profile rises and falls again.
        """
        distance = abs(crossed - self._begin)
        is_smooth = distance > _STEEP * self._limit * self._deviation and self._deviation > 0
        if is_smooth and EDGE < self._begin < 1 - EDGE:
            return None
        distance = max(distance, 1e-2)
        for _ in range(_MAX_PROBES):
            distance *= 2
            if distance >= abs(bound - self._begin):
                break
            place = self._begin + self._sign * distance
            profile = self.visit(place)
            if profile < self._limit:
                return place, profile
        return None

    def _cross(self, inner: tuple[float, float], outer: tuple[float, float]) -> tuple[float, float]:
        """Return the value and the coordinate between two places at which the limit is reached."""
        (at, low), (beyond, high) = inner, outer
        halved = False
        for _ in range(_MAX_STEPS):
            is_near = min(self._limit - low, high - self._limit) < _EXACT * self._limit
            if is_near or abs(beyond - at) < 1e-6:
                break
            share = 0.5 if halved else (self._limit - low) / (high - low)
            middle = at + min(max(share, 0.1), 0.9) * (beyond - at)
            halved = not halved
            profile = self.visit(middle)
            if profile < self._limit:
                at, low = middle, profile
            else:
                beyond, high = middle, profile
        crossed = at + (self._limit - low) / (high - low) * (beyond - at)
        return float(self._axis.value(crossed)), crossed

    def _bracket(self, bound: float, begin: tuple[float, float] | None = None) -> Any:
        """Return the places around the limit, from one on; None for the outer one at the bound."""
        begin = begin or self._visited[0]
        step = max(abs(self._visited[-1][0] - self._begin), 0.0) or 0.02
        for _ in range(_MAX_STEPS):
            places = sorted(
                (one for one in self._visited if self._sign * (one[0] - begin[0]) >= 0),
                key=lambda one: abs(one[0] - self._begin),
            )
            outer = next((one for one in places if one[1] >= self._limit), None)
            if outer is not None:
                inside = [
                    one for one in places if abs(one[0] - self._begin) < abs(outer[0] - self._begin)
                ]
                return inside[-1], outer
            if places[-1][0] == bound:
                return places[-1], None
            ahead = places[-1][0] + self._sign * step
            self.visit(min(max(ahead, EDGE), 1 - EDGE))
            step *= 2
        return places[-1], None

    def _end_at(self, bound: float) -> float:
        """Return the end of a profile that stays under the limit up to the end of the range."""
        if self._sign > 0 and self._axis.ends_with_picture:
            return math.inf
        self._last = self._optimum.point
        places = (bound - self._sign * share for share in (_PART, _PART / 2, 0.0))
        above = [self.visit(place) ** 2 for place in places]
        if max(above) - min(above) < _FLAT:
            return self._sign * math.inf
        return float(self._axis.value(float(self._sign > 0)))
