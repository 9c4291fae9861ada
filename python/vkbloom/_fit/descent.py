"""The search by derivatives: least squares from the start, and if needed what Search does."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._fit.search import CLOSE, ENOUGH, STEPS, Search, SpentError
from vkbloom._fit.space import Point, Space
from vkbloom.reference._derivatives import differentiable

#: From settings to the function that takes a cotangent to the derivatives by each field.
Back = Callable[[Any], Callable[[NDArray[np.float64]], Any]]

_MAX_STEPS: Final = 60
# Signs of sums of differences, and the derivatives of these sums.
_Sums = tuple[NDArray[np.int8], NDArray[np.float64]]
# How many points' sums are taken together, and how near these are.
_MAX_ESTIMATES: Final = 4
_NEAR: Final = 0.01
# How far from the ends the last steps begin.
_INSIDE: Final = 0.02


def check_derivatives(spaces: list[Space], loss: object, pixels: object) -> None:
    """Raise ValueError for fields and losses without a derivative, and without an array."""
    if pixels is None:
        raise ValueError("image: gradient=True needs the array, not the uploaded image")
    if callable(loss) or loss == "flip":
        raise ValueError(
            f"loss: {loss!r} has no derivative; give 'relative', 'l2' or 'log', or gradient=False"
        )
    for space in spaces:
        known = differentiable(space.settings(space.origin))
        for axis in space.axes:
            if axis.name not in known:
                raise ValueError(
                    f"vary: {axis.name!r} of the method {space.start.method} has no derivative; "
                    "give gradient=False"
                )


class _StalledError(Exception):
    """The last steps have not made the loss smaller."""


def _is_stalled(losses: list[float], axes: int) -> bool:
    """Return whether the last losses are not below nine tenths of what was reached before."""
    patience = {1: ENOUGH / 100, 2: ENOUGH, 6: CLOSE, 4 + axes // 2: np.inf}
    for steps, limit in patience.items():
        before = min(losses[:-steps], default=np.inf)
        if before <= limit and min(losses[-steps:]) > 0.9 * before:
            return True
    return False


class Descent(Search):
    """A search like `Search` whose steps follow from one pullback each.

    `back`: From settings to the function that takes a cotangent of the framebuffer to the
    derivatives by each field.
    """

    def __init__(self, back: Back, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._derivatives = back
        self._random = np.random.default_rng(0)

    def run(self) -> None:
        """Search from the start, and as without derivatives where that ends far from the target."""
        try:
            self._follow(self._space.origin)
            if self.loss > self._close:
                # Differences see over the kinks at which taps move from texel to texel.
                self._descend(self.best, STEPS[0], most=3)
                self._follow(self.best, "dogbox")
            if ENOUGH < self.loss <= self._close:
                # At an end, as that of a knee of 0, a derivative may be 0.
                self._follow(np.clip(self.best, _INSIDE, 1 - _INSIDE))
        except SpentError:
            return
        if self.loss > self._close:
            super().run()

    def _settle(self) -> None:
        self._follow(self.best)

    def _follow(self, point: Point, way: str = "trf") -> None:
        """Find the minimum near a point.

        Gauss and Newton's method needs the Jacobian J of all residuals, and a pullback gives one
        sum of its rows. So `least_squares` gets the residuals in other axes: the first is the loss,
        whose row is the exact gradient. The others are 0: sums with random signs, less their share
        of the residuals. Where a loss of 0 is near, the step is the same as with all rows. Where
        steps are slow, sums of several points together are a better estimate.
        """
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        begun = len(self.history)
        arrays: list[NDArray[np.float64]] = []  # the last one, where a step was accepted
        estimates: list[_Sums] = []
        visited: list[Point] = []

        def residual(part: Point) -> NDArray[np.float64]:
            arrays[:] = [self._values(part)]
            if _is_stalled(self.history[begun:], len(part)):
                raise _StalledError
            return np.append(self.history[-1], np.zeros(len(part)))

        def jacobian(part: Point) -> NDArray[np.float64]:
            (array,) = arrays
            unit = self._measure.differences(array)
            unit /= max(float(np.linalg.norm(unit)), 1e-30)
            gradient, sums = self._sums(part, array, unit)
            moved = np.abs(part - visited[-1]).max() if visited else 1.0
            visited.append(part.copy())
            if moved > _NEAR:
                estimates.clear()
            estimates.append(sums)
            del estimates[:-_MAX_ESTIMATES]
            rows = [
                row - np.vdot(each, unit) * gradient
                for signs, results in estimates
                for each, row in zip(signs, results, strict=True)
            ]
            # Of the rows only the products of columns count.
            return np.vstack([gradient, np.linalg.qr(np.array(rows) / np.sqrt(len(rows)), "r")])

        # What stalls keeps its best point.
        with contextlib.suppress(_StalledError):
            optimize.least_squares(
                residual,
                np.clip(point, 1e-9, 1 - 1e-9),
                jacobian,
                bounds=(0.0, 1.0),
                x_scale="jac",
                ftol=1e-4,
                xtol=1e-7,
                gtol=1e-14,
                method=way,
                max_nfev=_MAX_STEPS,
            )

    def _sums(
        self, part: Point, array: NDArray[np.float64], unit: NDArray[np.float64]
    ) -> tuple[Point, _Sums]:
        """Return the derivatives of the sum of differences times `unit`, and of random sums."""
        shape = (2 * len(part) + 4, *unit.shape)
        signs = 1 - 2 * self._random.integers(0, 2, shape, np.int8)
        scales = self._measure.scales(array)
        back = self._derivatives(self._space.settings(part))
        results = [back(each * scales) for each in (unit, *signs)]
        rows = np.array([[float(each[axis.name]) for axis in self._space.axes] for each in results])
        rows *= [axis.slope(at) for axis, at in zip(self._space.axes, part, strict=True)]
        return rows[0], (signs, rows[1:])
