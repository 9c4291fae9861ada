"""The search for settings: samples, then least squares or a simplex, then single integers.

SciPy does the optimizing. What is here chooses where it starts, and the order of the renders, so
that few passes run from one to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._checks import import_extra
from vkbloom._fit.losses import Measure
from vkbloom._fit.space import Point, Space

__all__ = ["CLOSE", "ENOUGH", "STEPS", "Search", "SpentError"]

# Coordinates are from 0 to 1.
# Steps of finite differences: first large compared with the rounding of half floats, then small.
STEPS: Final = (1e-2, 1e-3)
# A logarithmic axis wider than _ENDLESS times its scale is sampled within _REACH of the start.
_REACH: Final = 0.25
_ENDLESS: Final = 100.0
# Samples for each varied field. Least squares start from _STARTS points, one of them given.
_SAMPLES: Final = 6
_STARTS: Final = 5
#: The search ends at ENOUGH, the loss of rounding to half floats. Below CLOSE it only polishes, or
#: below a share of the loss without bloom, where that is less.
ENOUGH: Final = 2e-5
CLOSE: Final = 5e-4
# After a change of integers, choices or one number, numbers are optimized for the best _FOLLOWED.
_FOLLOWED: Final = 3
# Distant values to try of each number.
_LEAPS: Final = 8


class SpentError(Exception):
    """The search has made `max_calls` calls."""


class Search:
    """A search in one space, at one size of the image.

    - `render`: Takes settings, returns the framebuffer as float64 (H, W, 3).
    - `max_calls`: How often it may be called.
    - `costs`: Passes that run after a change of each varied field alone.
    - `told`: Is called with the loss of each call.
    - `close`: Below this loss the search only polishes.
    """

    def __init__(
        self,
        space: Space,
        measure: Measure,
        render: Callable[[Any], NDArray[np.float64]],
        *,
        max_calls: int,
        costs: NDArray[np.int_],
        told: Callable[[float], None],
        close: float = CLOSE,
    ) -> None:
        self._space = space
        self._measure = measure
        self._render = render
        self._left = max_calls
        self._costs = costs
        self._told = told
        self._close = close
        self.best = space.origin
        self.loss = np.inf
        self.history: list[float] = []

    def run(self, points: list[Point]) -> None:
        """Search from some points, the first of which is the start."""
        try:
            losses = [self._loss(point) for point in points]
            if self.loss <= ENOUGH:
                return
            starts = [*points, *self._samples()]
            losses += [self._loss(point) for point in starts[len(points) :]]
            self._halve(starts, losses)
            self._polish()
        except SpentError:
            return

    def _halve(self, starts: list[Point], losses: list[float]) -> None:
        """Take a few steps from the best starts, and continue from the two best results."""
        order = [0, *np.argsort(losses, kind="stable")]
        # Of one combination of integers and choices, only the best start.
        discrete = {tuple(starts[number][~self._space.is_number]): number for number in order[::-1]}
        chosen = [number for number in order if number in discrete.values()]
        reached = []
        for number in list(dict.fromkeys([0, *chosen, *order]))[:_STARTS]:
            reached.append(self._descend(starts[number], STEPS[0], most=5))
            if self.loss <= ENOUGH:
                return
        for _, point in sorted(reached, key=lambda one: one[0])[:2]:
            self._descend(point, STEPS[0])
            if self.loss <= ENOUGH:
                return

    def refine(self, points: list[Point]) -> None:
        """Search near the best of some points."""
        try:
            losses = [self._loss(point) for point in points]
            self._descend(points[int(np.argmin(losses))], STEPS[0])
            self._polish()
        except SpentError:
            return

    def _polish(self) -> None:
        """Vary integers, choices and single numbers, while the loss improves by one percent."""
        before = np.inf
        while ENOUGH < self.loss < 0.99 * before:
            before = self.loss
            self._walk()
            self._descend(self.best, STEPS[1])
            if self.loss > self._close:
                # Where pixels cross a hard threshold one by one, the derivative is 0.
                self._along_lines()
                self._descend(self.best, STEPS[0])
                if self._measure.is_rounded:
                    # Levels make a valley rough, and derivatives along it are lost in them.
                    self._simplex(self.best, STEPS[0], 10)
            if self.loss > self._close:
                self._leap()

    def _values(self, point: Point) -> NDArray[np.float64]:
        """Render, and keep count."""
        if self._left < 1:
            raise SpentError
        self._left -= 1
        array = self._render(self._space.settings(point))
        loss = self._measure(array)
        self.history.append(loss)
        self._told(loss)
        if loss < self.loss:
            self.best, self.loss = point.copy(), loss
        return array

    def _loss(self, point: Point) -> float:
        self._values(point)
        return self.history[-1]

    @property
    def _pending(self) -> tuple[Point, Point]:
        """The coordinates between which all of the space is searched."""
        wide = np.array(
            [
                axis.scale is not None and axis.high > _ENDLESS * axis.scale
                for axis in self._space.axes
            ]
        )
        low = np.where(wide, np.maximum(self._space.origin - _REACH, 0), 0.0)
        return low, np.where(wide, np.minimum(self._space.origin + _REACH, 1), 1.0)

    def _samples(self) -> list[Point]:
        """Return points that fill the space, with neighbours that differ in cheap fields."""
        qmc = import_extra("scipy.stats", "fit", "Fitting").qmc
        count = len(self._space.axes)
        units = qmc.Halton(count, scramble=False).random(_SAMPLES * count + 1)[1:]
        is_expensive = self._costs > self._costs.min()
        # Each value of the expensive fields occurs with two of the cheap ones.
        if is_expensive.any() and not is_expensive.all():
            units[:, is_expensive] = np.repeat(
                units[: -(-len(units) // 2), is_expensive], 2, axis=0
            )[: len(units)]
        low, high = self._pending
        return list(low + (high - low) * units)

    def _descend(self, point: Point, step: float, most: int = 30) -> tuple[float, Point]:
        """Find the minimum of the continuous fields near a point, in `most` steps."""
        free = np.flatnonzero(self._space.is_number)
        if not free.size:
            return np.inf, point
        if not self._measure.is_sum:
            return self._simplex(point, step, most)
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        # Cheap fields first: the render for the next field also resets the field before it.
        order = free[np.argsort(self._costs[free], kind="stable")]

        def at(part: Point) -> Point:
            whole = point.copy()
            whole[order] = part
            return whole

        def residual(part: Point) -> NDArray[np.float64]:
            return self._measure.residual(self._values(at(part)))

        def jacobian(part: Point) -> NDArray[np.float64]:
            columns = []
            base = known.get(part.tobytes())
            base = residual(part) if base is None else base
            for index in range(len(part)):
                moved = part.copy()
                moved[index] += step if part[index] <= 0.5 else -step
                columns.append((residual(moved) - base) / (moved[index] - part[index]))
            return np.stack(columns, axis=1)

        known: dict[bytes, NDArray[np.float64]] = {}

        def remembered(part: Point) -> NDArray[np.float64]:
            known.clear()
            known[part.tobytes()] = residual(part)
            return known[part.tobytes()]

        found = optimize.least_squares(
            remembered,
            np.clip(point[order], 1e-9, 1 - 1e-9),
            jacobian,
            bounds=(0.0, 1.0),
            x_scale="jac",
            ftol=1e-4,
            xtol=1e-5,
            gtol=1e-12,
            max_nfev=most,
        )
        return float(found.cost), at(found.x)

    def _simplex(self, point: Point, step: float, most: int) -> tuple[float, Point]:
        """Find the minimum of the loss itself near a point."""
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        free = np.flatnonzero(self._space.is_number)
        begun = point[free]
        simplex = np.repeat(begun[np.newaxis], len(free) + 1, axis=0)
        for index in range(len(free)):
            simplex[index + 1, index] += 10 * step * (1 if begun[index] <= 0.5 else -1)

        def loss(part: Point) -> float:
            whole = point.copy()
            whole[free] = part
            return self._loss(whole)

        found = optimize.minimize(
            loss,
            begun,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(free),
            options={
                "initial_simplex": simplex,
                "xatol": step / 10,
                "fatol": 1e-6,
                "maxiter": 10 * most,
            },
        )
        whole = point.copy()
        whole[free] = found.x
        return float(found.fun), whole

    def _along_lines(self) -> None:
        """Minimize along one continuous field after the other."""
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        for index in np.flatnonzero(self._space.is_number):
            held = self.best.copy()

            def loss(place: float, held: Point = held, index: int = int(index)) -> float:
                point = held.copy()
                point[index] = place
                return self._loss(point)

            for reach in (0.2, 0.02):
                ends = np.clip(self.best[index] + np.array([-reach, reach]), 0.0, 1.0)
                optimize.minimize_scalar(
                    loss, bounds=ends, method="bounded", options={"maxiter": 10}
                )

    def _leap(self) -> None:
        """Try distant values of single numbers: some have a valley for each number of levels."""
        places = (np.arange(_LEAPS) + 0.5) / _LEAPS
        for index in np.flatnonzero(self._space.is_number):
            low, high = self._pending[0][index], self._pending[1][index]
            tried = []
            for place in low + (high - low) * places:
                point = self.best.copy()
                point[index] = place
                tried.append((self._loss(point), point))
            for _, point in sorted(tried, key=lambda one: one[0])[:_FOLLOWED]:
                self._descend(point, STEPS[0], most=6)
                if self.loss <= self._close:
                    return

    def _walk(self) -> None:
        """Try other integers and choices, and optimize the numbers for the best of them."""
        for index, axis in enumerate(self._space.axes):
            is_moving = axis.kind != "number"
            while is_moving:
                held = self.loss
                tried = []
                for value in axis.others(axis.value(float(self.best[index]))):
                    point = self.best.copy()
                    point[index] = axis.coordinate(value)
                    tried.append((self._loss(point), point))
                if self.loss >= held:
                    for _, point in sorted(tried, key=lambda one: one[0])[:_FOLLOWED]:
                        self._descend(point, STEPS[0], most=6)
                is_moving = self.loss < held
