"""The search by derivatives: least squares from the start and from the best of a few samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.fits.losses import Measure
from vkbloom.fits.search import ENOUGH, Search, SpentError
from vkbloom.fits.space import Point, Space
from vkbloom.reference.derivatives import differentiable

__all__ = ["Descent", "check_derivatives"]

#: From settings to the framebuffer, and from a cotangent to the derivatives by each field.
Pull = Callable[[Any], tuple[NDArray[np.float64], Callable[[NDArray[np.float64]], Any]]]

# Starts that a few samples are taken for, and steps of a first descent from each.
_STARTS: Final = 3
_FIRST_STEPS: Final = 8
_STEPS: Final = 60
# Fields this near to an end of their range start once more from other places.
_END: Final = 1e-3
_MIDDLES: Final = (0.5, 0.25)


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


class Descent(Search):
    """A search like `Search` whose steps follow from one pullback each.

    `pull`: Takes settings, returns the framebuffer and its pullback.
    """

    def __init__(self, space: Space, measure: Measure, pull: Pull, **given: Any) -> None:
        super().__init__(space, measure, self._pulled, **given)
        self._pull = pull
        self._back: Any = None
        self._random = np.random.default_rng(0)

    def run(self, points: list[Point]) -> None:
        """Search from some points, and from samples if these are not enough."""
        try:
            self._follow(self._best_of(points), _STEPS)
            if self.loss <= ENOUGH:
                return
            for middle in _MIDDLES:
                # A field at the end of its range keeps the others from their values.
                ends = (self.best < _END) | (self.best > 1 - _END)
                self._follow(np.where(ends, middle, self.best), _STEPS)
            samples = self._samples()[:: max(1, len(self._space.axes) // 2)]
            losses = [self._loss(point) for point in samples]
            for number in np.argsort(losses, kind="stable")[:_STARTS]:
                self._follow(samples[number], _FIRST_STEPS)
            self._follow(self.best, _STEPS)
        except SpentError:
            return

    def refine(self, points: list[Point]) -> None:
        """Search near the best of some points."""
        try:
            self._follow(self._best_of(points), _STEPS)
        except SpentError:
            return

    def _best_of(self, points: list[Point]) -> Point:
        return points[int(np.argmin([self._loss(point) for point in points]))]

    def _pulled(self, settings: Any) -> NDArray[np.float64]:
        array, self._back = self._pull(settings)
        return array

    def _follow(self, point: Point, most: int) -> None:
        """Find the minimum near a point in `most` steps.

        Gauss and Newton's method needs the products of all columns of the Jacobian J. Rows of J are
        pullbacks of random signs, which estimate these products. The gradient is exact, so the
        estimate decides the speed alone. `least_squares` gets residuals and a Jacobian of few rows
        with this gradient, these products and this loss.
        """
        optimize = import_extra("scipy.optimize", "fit", "Fitting")
        known: dict[bytes, NDArray[np.float64]] = {}

        def residual(part: Point) -> NDArray[np.float64]:
            square, gradient, factor = self._model(part)
            known.clear()
            known[part.tobytes()] = factor
            first = linear.solve_triangular(factor, gradient, trans="T")
            rest = square - float(first @ first)
            return np.append(first, np.sqrt(max(rest, 0.0)))

        def jacobian(part: Point) -> NDArray[np.float64]:
            factor = known[part.tobytes()]
            return np.vstack([factor, np.zeros(len(part))])

        linear = import_extra("scipy.linalg", "fit", "Fitting")
        optimize.least_squares(
            residual,
            np.clip(point, 1e-9, 1 - 1e-9),
            jacobian,
            bounds=(0.0, 1.0),
            x_scale="jac",
            ftol=1e-4,
            xtol=1e-7,
            gtol=1e-14,
            max_nfev=most,
        )

    def _model(self, part: Point) -> tuple[float, Point, NDArray[np.float64]]:
        """Return the square of the loss, half its gradient g, and U of the products U'U = J'J."""
        array = self._values(part)
        if self.loss <= ENOUGH:
            raise SpentError
        square, cotangent = self._measure.slope(array)
        gradient = self._rows(part, cotangent / 2)
        scale = self._measure.scales(array)
        count = 2 * len(part) + 4
        signs = self._random.choice((-1.0, 1.0), (count, *array.shape))
        rows = np.stack([self._rows(part, scale * one) for one in signs]) / np.sqrt(count)
        products = rows.T @ rows
        # A field without an effect here has no row; it stays where it is.
        products += np.diag(np.maximum(1e-9 * products.diagonal(), 1e-30))
        # The loss bounds the part of the residuals that J explains.
        explained = float(gradient @ np.linalg.solve(products, gradient))
        products *= max(1.0, explained / max(square, 1e-30))
        return square, gradient, np.linalg.cholesky(products).T

    def _rows(self, part: Point, cotangent: NDArray[np.float64]) -> Point:
        """Return the derivatives of a sum over the framebuffer by each coordinate."""
        found = self._back(cotangent)
        return np.array(
            [
                float(found[axis.name]) * axis.slope(float(place))
                for axis, place in zip(self._space.axes, part, strict=True)
            ]
        )
