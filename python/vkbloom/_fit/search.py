"""The search for settings: differential evolution, then least squares or a simplex, by SciPy."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._fit.losses import Measure
from vkbloom._fit.space import Point, Space

# Coordinates are from 0 to 1.
# Steps of finite differences: first large compared with the rounding of half floats, then small.
STEPS: Final = (1e-2, 1e-3)
# A logarithmic axis wider than _ENDLESS times its scale is sampled within _REACH of the start.
_REACH: Final = 0.25
_ENDLESS: Final = 100.0
# Members of a population for each varied field, and its generations: the first population is only
# measured, and others follow while the loss is not close. Least squares begin at the start and at
# the best members.
_MEMBERS: Final = 6
_GENERATIONS: Final = (0, 6, 12, 24, 48)
_STARTS: Final = 5
#: The search ends at ENOUGH, the loss of rounding to half floats. Below CLOSE it only polishes, or
#: below a share of the loss without bloom, where that is less.
ENOUGH: Final = 2e-5
CLOSE: Final = 5e-4
# A population ends below this loss: least squares do the rest.
_NEAR: Final = 0.05


class SpentError(Exception):
    """The search has made `max_calls` calls."""


class Search:
    """A search in one space, at one size of the image.

    - `render`: Takes settings, returns the framebuffer as float64 (H, W, 3).
    - `max_calls`: How often it may be called.
    - `on_loss`: Is called with the loss of each call.
    - `close`: Below this loss the search only polishes.
    """

    def __init__(
        self,
        space: Space,
        measure: Measure,
        render: Callable[[Any], NDArray[np.float64]],
        *,
        max_calls: int,
        on_loss: Callable[[float], None],
        close: float = CLOSE,
    ) -> None:
        self._space = space
        self._measure = measure
        self._render = render
        self._left = max_calls
        self._on_loss = on_loss
        self._close = close
        self.best = space.origin
        self.loss = np.inf
        self.history: list[float] = []

    def run(self) -> None:
        """Search all of the space."""
        with contextlib.suppress(SpentError):
            self._loss(self._space.origin)
            for turn in range(len(_GENERATIONS)):
                if self.loss > (self._close if turn else ENOUGH):
                    self._evolve(turn)
                    self._polish()

    def refine(self, point: Point) -> None:
        """Search near the better one of a point and the start."""
        with contextlib.suppress(SpentError):
            self._loss(self._space.origin)
            self._loss(point)
            self._settle()

    def _settle(self) -> None:
        self._polish()

    def _polish(self) -> None:
        """Descend from the best point."""
        for step in STEPS:
            if self.loss > ENOUGH:
                self._descend(self.best, step)
        if self.loss > self._close and self._measure.is_rounded:
            # Levels make a valley rough, and derivatives along it are lost in them.
            self._simplex(self.best, STEPS[0], 10)

    def _values(self, point: Point) -> NDArray[np.float64]:
        """Render, and keep count."""
        if self._left < 1:
            raise SpentError
        self._left -= 1
        array = self._render(self._space.settings(point))
        loss = self._measure(array)
        self.history.append(loss)
        self._on_loss(loss)
        if loss < self.loss:
            self.best, self.loss = point.copy(), loss
        return array

    def _loss(self, point: Point) -> float:
        self._values(point)
        return self.history[-1]

    @property
    def _ends(self) -> tuple[Point, Point]:
        """The coordinates between which all of the space is searched."""
        wide = np.array(
            [
                axis.scale is not None and axis.high > _ENDLESS * axis.scale
                for axis in self._space.axes
            ]
        )
        low = np.where(wide, np.maximum(self._space.origin - _REACH, 0), 0.0)
        return low, np.where(wide, np.minimum(self._space.origin + _REACH, 1), 1.0)

    def _evolve(self, turn: int) -> None:
        """Search all of the space by differential evolution, from points that fill it."""
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        qmc = import_extra("scipy.stats", "fit", "Fitting").qmc
        low, high = self._ends
        count = _MEMBERS * len(low)
        # Other points in each turn, and the best one of those before.
        units = qmc.Halton(len(low), scramble=False).random((turn + 1) * count + 1)[-count:]
        # Levels make a valley rough, so that least squares do not reach its end.
        enough = self._close if self._measure.is_rounded else min(_NEAR, self.loss / 2)
        result = optimize.differential_evolution(
            self._loss,
            np.stack([low, high], axis=1),
            init=np.clip([self.best, *(low + (high - low) * units)], low, high),
            maxiter=_GENERATIONS[turn],
            mutation=(0.5, 0.9),
            polish=False,
            rng=turn,
            callback=lambda intermediate_result: self.loss <= enough,
        )
        order = np.argsort(result.population_energies, kind="stable")
        for start in [self._space.origin, *result.population[order]][:_STARTS]:
            self._descend(start, STEPS[0], most=5)
            if self.loss <= self._close:
                return

    def _descend(self, point: Point, step: float, most: int = 30) -> None:
        """Find the minimum of the continuous fields near a point, in `most` steps."""
        free = np.flatnonzero(self._space.is_number)
        if not free.size:
            return
        if not self._measure.is_sum:
            self._simplex(point, step, most)
            return
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        known: dict[bytes, NDArray[np.float64]] = {}

        def residual(part: Point) -> NDArray[np.float64]:
            whole = point.copy()
            whole[free] = part
            return self._measure.residual(self._values(whole))

        def jacobian(part: Point) -> NDArray[np.float64]:
            columns = []
            for index in range(len(part)):
                moved = part.copy()
                moved[index] += step if part[index] <= 0.5 else -step
                change = residual(moved) - known[part.tobytes()]
                columns.append(change / (moved[index] - part[index]))
            return np.stack(columns, axis=1)

        def remember(part: Point) -> NDArray[np.float64]:
            known.clear()
            known[part.tobytes()] = result = residual(part)
            return result

        optimize.least_squares(
            remember,
            np.clip(point[free], 1e-9, 1 - 1e-9),
            jacobian,
            bounds=(0.0, 1.0),
            x_scale="jac",
            ftol=1e-4,
            xtol=1e-5,
            gtol=1e-12,
            max_nfev=most,
        )

    def _simplex(self, point: Point, step: float, most: int) -> None:
        """Find the minimum of the loss itself near a point."""
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        free = np.flatnonzero(self._space.is_number)
        begun = point[free]
        simplex = np.vstack([begun, begun + np.diag(np.where(begun <= 0.5, 10, -10) * step)])

        def loss(part: Point) -> float:
            whole = point.copy()
            whole[free] = part
            return self._loss(whole)

        optimize.minimize(
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
