"""Point-spread functions that depend on the place in the picture."""

from __future__ import annotations

import dataclasses
import inspect
import itertools
import math
import weakref
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vkbloom._arrays import plain_array
from vkbloom._numbers import check_floats, check_number, check_size
from vkbloom._psf.base import PSF, Array, crop_or_pad, in_grey
from vkbloom._psf.components import Components, components_of
from vkbloom._psf.places import Size, field_of, hat_weights, spread_places
from vkbloom._psf.sampled import samples
from vkbloom._psf.splines import moved_and_scaled
from vkbloom._psf.values import ArrayValue
from vkbloom._public import public
from vkbloom._settings.fields import value_field

Function = Callable[..., ArrayLike]
#: The x of the columns of a grid and the y of its rows, in pixels.
Positions = tuple[tuple[float, ...], tuple[float, ...]]

#: The arguments that a function may name; any other function is given u and v.
_NAMED: Final = frozenset({"u", "v", "radius", "angle", "aspect"})
#: Places along each side at which facts about the whole field are taken.
_PLACES: Final = 9


def _read_array(name: str, values: Any) -> ArrayValue:
    # Zarr arrays are not arrays of NumPy, but convert to these.
    held = ArrayValue(values, name)
    if not np.isfinite(held.array).all():
        raise ValueError(f"{name}: some numbers are not finite as float32")
    return held


def _check_shapes(kernels: tuple[int, ...], weights: tuple[int, ...] | None) -> None:
    """Raise ValueError unless kernels are those of a grid, or have weights of such a shape."""
    form = "(gy, gx, h, w)" if weights is None else "(K, h, w)"
    sides = form.count(",") + 1
    if len(kernels) not in (sides, sides + 1) or kernels[sides:] not in ((), (3,)) or 0 in kernels:
        raise ValueError(
            f"kernels: shape {kernels} is not {form} or {form[:-1]}, 3) with sides of at least 1"
        )
    if weights is not None and (len(weights) != 3 or 0 in weights or weights[0] != kernels[0]):
        raise ValueError(f"weights: shape {weights} is not ({kernels[0]}, gy, gx)")


class _Functions:
    """The functions of this process by names, which stand for them in text."""

    def __init__(self) -> None:
        self._functions: weakref.WeakValueDictionary[str, Function] = weakref.WeakValueDictionary()

    def name_of(self, function: Function) -> str:
        """Return the name of a function, of which another one of the same name has a number."""
        own = getattr(function, "__qualname__", type(function).__qualname__)
        name = f"{getattr(function, '__module__', '')}.{own}"
        names = itertools.chain([name], (f"{name} {number}" for number in itertools.count(2)))
        return next(one for one in names if self._functions.setdefault(one, function) == function)

    def find(self, name: str) -> Function:
        if (found := self._functions.get(name)) is None:
            raise ValueError(
                f"function: {name!r} was a function of another process; store kernels on a grid "
                "in its place: sampled(frame, places)"
            )
        return found


_FUNCTIONS: Final = _Functions()


def _read_function(function: Any) -> Function:
    if isinstance(function, str):
        return _FUNCTIONS.find(function)
    if isinstance(function, Mapping) or not callable(function):
        raise TypeError(f"function: {function!r} is not a function of u and v")
    # Settings are found by their values.
    hash(function)
    return cast("Function", function)


def _read_three(name: str, values: Any, low: float) -> tuple[float, ...]:
    numbers = check_floats(name, values)
    if len(numbers) != 3:
        raise ValueError(f"{name}: {numbers!r} is not 3 numbers, of red, green and blue")
    for number in numbers:
        if not low < number:
            raise ValueError(f"{name}: {number!r} is out of range, above {low:g}")
    return numbers


def _read_tolerance(tolerance: Any) -> float:
    number = check_number("tolerance", tolerance, 0, 1)
    if number == 0:
        raise ValueError(f"tolerance: {tolerance!r} is out of range, above 0 up to 1")
    return number


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class Varying(PSF):
    """A field of kernels, defined in pixels: each light is spread by the kernel of its own place.

    Parameters
    ----------
    kernels : array-like, shape (gy, gx, h, w) or (gy, gx, h, w, 3), optional
        Measured kernels on a grid of `positions`: an array, a Zarr array, or a `GriddedPSFModel` of
        photutils, which brings its positions. The tap [h // 2, w // 2] lies on the light. The array
        is copied to float32. Between the positions kernels are interpolated bilinearly; outside of
        them they are those of the nearest edge.
    positions : (xs, ys), or array-like, shape (gy, gx, 2) or (gy * gx, 2), optional
        The pixels of the grid, where the centre of the picture's first pixel is (0, 0): the x of
        its columns and the y of its rows, or the (x, y) of each kernel. They must increase.
        Default: evenly from the first pixel to the last one, 0 to W - 1 and 0 to H - 1.
    function : callable, optional
        In place of `kernels`: ``function(u, v)`` returns the kernel of a place, an array (h, w) or
        (h, w, 3) that has the same shape everywhere. With R half of the picture's diagonal in
        pixels, u is (x - (W - 1) / 2) / R and v is (y - (H - 1) / 2) / R, downwards, so that the
        corners have the radius 1. Arguments that are named "radius", "angle" (atan2(v, u)) and
        "aspect" (W / H) get these.
    size : (int, int), optional
        Width and height of the function's kernels, which then must have it.
    scales : (float, float, float), optional
        Factors of the widths of red, green and blue, above 0.
    lateral : (float, float, float), optional
        Lateral colour: red, green and blue are shifted outwards by these pixels times the radius.
    weights : array-like, shape (K, gy, gx), optional
        The weights of K kernels, of shape (K, h, w) or (K, h, w, 3), at the positions: the kernel
        of a place is the sum over k of weights[k] kernels[k]. They have derivatives, "psf.weights".
    tolerance : float
        Of a function and of lateral colour: the error of the result that is accepted, above 0 up
        to 1. See Notes.

    Raises
    ------
    TypeError, ValueError
        An argument has another type, shape or range, both or neither of `kernels` and `function`
        are given, the positions are not a grid, or there are weights and no kernels, or scales.

    Notes
    -----
    With the kernel K_q of place q, the bloom at p is the sum over q of glow(q) K_q(p - q). So the
    flux of a light is kept where the sum of its kernel is 1. A flat picture does not stay flat.
    Kernels are taken as they are: `Convolution.normalize` does not change them. `Gathered` is the
    other meaning, in which each pixel has a blur of its own.

    The sum is computed as the sum over k of K_k * (w_k glow), with few kernels K_k and weights w_k
    that depend on the place. For a grid without lateral colour this is exact. For a function, and
    with lateral colour, K_0 is the mean kernel, whose weight is the sum of the place's kernel. The
    others have a sum of 0, so that flux does not depend on their number. There are as many as are
    needed so that, at places between those at which the function was called, kernels differ from
    the function's by at most `tolerance`: each tap relative to the largest one, and the worst
    picture of 0 to 1 relative to the sum. There are at most 128 beside the mean. `components`
    returns kernels, weights and the error.

    Scaled and shifted kernels are interpolated by splines, and keep their sums.

    Examples
    --------
    >>> def coma(u, v):
    ...     y, x = np.mgrid[-8:9, -8:9]
    ...     spot = np.exp(-((x - 3 * u) ** 2 + (y - 3 * v) ** 2) / (2 + 8 * (u * u + v * v)))
    ...     return spot / spot.sum()
    >>> lens = vkbloom.psf.Varying(function=coma)
    >>> lens.at(0, 0, frame=(64, 48)).shape
    (17, 17, 3)
    """

    unit = "pixel"
    #: Whether each pixel collects light by its own kernel, instead of spreading it.
    gathers: ClassVar[bool] = False

    kernels: Any = value_field(None, read=lambda given: _read_array("kernels", given))
    positions: Any = value_field(None)
    _: dataclasses.KW_ONLY
    function: Any = value_field(None, read=_read_function)
    size: Any = value_field(None, read=lambda size: check_size("size", size))
    scales: Any = value_field(None, read=lambda given: _read_three("scales", given, 0.0))
    lateral: Any = value_field(None, read=lambda given: _read_three("lateral", given, -math.inf))
    weights: Any = value_field(None, read=lambda given: _read_array("weights", given))
    tolerance: float = value_field(1e-3, read=_read_tolerance)

    def __post_init__(self) -> None:
        if hasattr(self.kernels, "grid_xypos"):
            kernels, positions = _of_photutils(self.kernels)
            object.__setattr__(self, "kernels", kernels)
            object.__setattr__(self, "positions", positions)
        if (self.kernels is None) == (self.function is None):
            raise TypeError(f"{type(self).__name__}: either kernels or function is needed")
        super().__post_init__()
        if self.function is not None:
            for name in ("positions", "weights"):
                if getattr(self, name) is not None:
                    raise TypeError(f"{name}: those of kernels; a function has none")
            return
        if self.size is not None:
            raise TypeError("size: that of a function's kernels; an array has its own")
        _check_shapes(self.kernels.array.shape, self.weights and self.weights.array.shape)
        for name in ("scales", "lateral"):
            if self.weights is not None and getattr(self, name) is not None:
                raise TypeError(f"{name}: kernels with weights are not changed by the place")
        if self.positions is not None:
            positions = _read_positions(self.positions, *self._grid_shape)
            object.__setattr__(self, "positions", positions)

    def to_dict(self) -> dict[str, Any]:
        """Return the name of the class, and the fields by name.

        Returns
        -------
        dict
            Values that JSON can represent. A function is its name, by which only this process knows
            it; `sampled` makes what others can read.
        """
        named = {} if self.function is None else {"function": _FUNCTIONS.name_of(self.function)}
        return super().to_dict() | named

    @property
    def kernel_size(self) -> Size:
        """Width and height of all kernels."""
        height, width = self._middle.shape[:2]
        return width, height

    def at(self, x: float, y: float, frame: Size) -> Array:
        """Return the kernel of a place.

        Parameters
        ----------
        x, y : float
            The place in pixels; (0, 0) is the centre of the first pixel.
        frame : (int, int)
            Width and height of the picture.

        Returns
        -------
        ndarray of float64, shape (h, w, 3)
        """
        width, height = check_size("frame", frame)
        kernels = self.on_grid(check_floats("x", [x]), check_floats("y", [y]), (width, height))
        return np.asarray(kernels[0, 0])

    def components(self, frame: Size) -> Components:
        """Return the kernels and weights whose products are computed for a picture.

        Parameters
        ----------
        frame : (int, int)
            Width and height of the picture.

        Returns
        -------
        Components
            A named tuple of `kernels`, `weights`, the places `xs` and `ys` of the weights, and the
            `error`.
        """
        return components_of(self, check_size("frame", frame))

    def sampled(self, frame: Size, places: Size) -> Varying:
        """Return the field as measured kernels at evenly spread places, from edge to edge.

        Parameters
        ----------
        frame : (int, int)
            Width and height of the picture.
        places : (int, int)
            Number of places along x and along y.
        """
        frame = check_size("frame", frame)
        xs, ys = (
            tuple(spread_places(side, count))
            for side, count in zip(frame, check_size("places", places), strict=True)
        )
        return type(self)(self.on_grid(xs, ys, frame), (xs, ys), tolerance=self.tolerance)

    def array(self, size: Size, pixels_per_degree: float | None = None) -> Array:
        """Return the field drawn over a picture: kernels side by side, each at its place.

        Parameters
        ----------
        size : (int, int)
            Width and height of the picture in pixels.
        pixels_per_degree : float, optional
            Ignored.

        Returns
        -------
        ndarray of float64, shape (height, width, 3)
            Linear RGB. If the picture has no space for two kernels, that of its centre at
            [height // 2, width // 2].
        """
        frame = check_size("size", size)
        counts = [max(side // own, 1) for side, own in zip(frame, self.kernel_size, strict=True)]
        xs, ys = (
            (np.arange(count) + 0.5) * side / count - 0.5
            for side, count in zip(frame, counts, strict=True)
        )
        kernels = self.on_grid(xs, ys, frame)
        if counts == [1, 1]:
            return crop_or_pad(kernels[0, 0], frame)
        result = np.zeros((frame[1], frame[0], 3))
        for y, row in zip(ys, kernels, strict=True):
            for x, kernel in zip(xs, row, strict=True):
                height, width = np.minimum(kernel.shape, result.shape)[:2].tolist()
                top = min(max(round(y) - height // 2, 0), frame[1] - height)
                left = min(max(round(x) - width // 2, 0), frame[0] - width)
                result[top : top + height, left : left + width] += crop_or_pad(
                    kernel, (width, height)
                )
        return result

    def energy(self) -> Array:
        """Return the mean of the kernels' sums, over the grid or a square picture.

        Returns
        -------
        ndarray of float64, shape (3,)
        """
        return self._mean.energy()

    def encircled_energy(self, radii: ArrayLike) -> Array:
        """Return the energy of the mean kernel inside circles around the point.

        Parameters
        ----------
        radii : array-like of float, shape (N,)
            In pixels, at least 0.

        Returns
        -------
        ndarray of float64, shape (N, 3)
        """
        return self._mean.encircled_energy(radii)

    def mtf(self, frequencies: ArrayLike) -> Array:
        """Return the modulation transfer function of the mean kernel along the horizontal.

        Parameters
        ----------
        frequencies : array-like of float, shape (N,)
            In cycles per pixel, at least 0.

        Returns
        -------
        ndarray of float64, shape (N, 3)
        """
        return self._mean.mtf(frequencies)

    def kernel(
        self,
        frame: Size,
        size: Size | None = None,
        pixels_per_degree: float | None = None,
    ) -> Array:
        """Raise ValueError: there is no one kernel; `at` returns that of a place."""
        raise ValueError(
            f"psf: a psf.{type(self).__name__} is not one kernel, as it is needed here; use "
            "at(x, y, frame), or vkbloom.Convolution"
        )

    @property
    def _mean(self) -> samples:
        if self.weights is not None:
            shares = self.weights.array.mean(axis=(1, 2), dtype=np.float64)
            return samples(np.tensordot(shares, self._kernels, 1))
        side = 1001  # of a picture in which the places of `kernels` without positions do not matter
        if self.kernels is not None and self.scales is None and self.lateral is None:
            kernels = in_grey(self._kernels) if self._kernels.ndim == 4 else self._kernels
        else:
            places = np.linspace(0, side - 1, _PLACES)
            kernels = self.on_grid(places, places, (side, side))
        return samples(kernels.mean(axis=(0, 1)))

    @property
    def _kernels(self) -> Array:
        return np.asarray(self.kernels.array, np.float64)

    @property
    def _middle(self) -> NDArray[Any]:
        """The kernel of the field's centre, or of the grid's first position."""
        if self.kernels is not None:
            given = self.kernels.array[0]
            return cast("NDArray[Any]", given if self.weights is not None else given[0])
        return self._evaluate(0.0, 0.0, 1.0)

    @property
    def _grid_shape(self) -> tuple[int, int]:
        """Rows and columns of the grid of kernels, or of weights."""
        own = self.kernels.array.shape[:2] if self.weights is None else self.weights.array.shape[1:]
        return int(own[0]), int(own[1])

    @property
    def has_grid(self) -> bool:
        """Whether all kernels are sums of those of a grid; else each place has one of its own.

        Lateral colour shifts kernels by a distance that depends on their place.
        """
        return self.function is None and not any(self.lateral or ())

    def grid_of(self, frame: Size) -> tuple[Array, Array]:
        """Return the x of the grid's columns and the y of its rows for a picture, in pixels."""
        if self.positions is not None:
            return np.array(self.positions[0]), np.array(self.positions[1])
        rows, columns = self._grid_shape
        return spread_places(frame[0], columns), spread_places(frame[1], rows)

    def grid_kernels(self, frame: Size) -> Array:
        """Return the kernels at the grid's positions, (gy, gx, h, w) or (gy, gx, h, w, 3)."""
        if self.weights is not None:
            return np.tensordot(self.weights.array.astype(np.float64), self._kernels, (0, 0))
        return self._coloured_at(*self.grid_of(frame), self._kernels, frame)

    def on_grid(self, xs: Any, ys: Any, frame: Size) -> Array:
        """Return the kernels at places, (len(ys), len(xs), h, w, 3)."""
        if self.function is None:
            kernels = self._kernels if self.weights is None else self.grid_kernels(frame)
            columns, rows = self.grid_of(frame)
            across, down = hat_weights(columns, xs), hat_weights(rows, ys)
            made = np.einsum("yj,xi,ji...->yx...", down, across, kernels, optimize=True)
            made = self._coloured_at(xs, ys, made, frame)
        else:
            made = np.array([[self._kernel_at(x, y, frame) for x in xs] for y in ys])
        return in_grey(made) if made.ndim == 4 else made

    def _coloured_at(self, xs: Any, ys: Any, kernels: Array, frame: Size) -> Array:
        """Return kernels (len(ys), len(xs), h, w) with the scales and shifts of their places."""
        if self.scales is None and self.lateral is None:
            return kernels
        return np.array(
            [
                [
                    self._coloured(kernel, *field_of(x, y, frame))
                    for x, kernel in zip(xs, row, strict=True)
                ]
                for y, row in zip(ys, kernels, strict=True)
            ]
        )

    def _kernel_at(self, x: float, y: float, frame: Size) -> Array:
        u, v = field_of(x, y, frame)
        return self._coloured(self._evaluate(u, v, frame[0] / frame[1]), u, v)

    def _evaluate(self, u: float, v: float, aspect: float) -> Array:
        """Return what the function returns, in float64."""
        values = {"u": u, "v": v, "radius": math.hypot(u, v), "angle": math.atan2(v, u)}
        values["aspect"] = aspect
        names = _argument_names(self.function)
        made = self.function(*[values[name] for name in names])
        kernel = plain_array(made, "function").astype(np.float64)
        if kernel.ndim not in (2, 3) or kernel.shape[2:] not in ((), (3,)) or 0 in kernel.shape:
            raise ValueError(f"function: shape {kernel.shape} is not (h, w) or (h, w, 3)")
        if self.size is not None and kernel.shape[1::-1] != self.size:
            raise ValueError(
                f"function: a kernel of {kernel.shape[1]} x {kernel.shape[0]} pixels is not of the "
                f"size {self.size[0]} x {self.size[1]}"
            )
        if not np.isfinite(kernel).all():
            raise ValueError(f"function: a value at u = {u:g}, v = {v:g} is not finite")
        return kernel

    def _coloured(self, kernel: Array, u: float, v: float) -> Array:
        if self.scales is None and self.lateral is None:
            return kernel
        channels = kernel if kernel.ndim == 3 else in_grey(kernel)
        scales, lateral = self.scales or (1.0,) * 3, self.lateral or (0.0,) * 3
        made = [
            moved_and_scaled(channels[..., c], (lateral[c] * u, lateral[c] * v), scales[c])
            for c in range(3)
        ]
        return np.stack(made, axis=-1)


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class Gathered(Varying):
    """A blur that depends on the place: each pixel collects light by the kernel of its own place.

    This is not what a lens does, for which `Varying` is: the flux of a light is not kept, and the
    picture of a light is a mixture of the kernels of many places. A flat picture stays flat.

    Parameters
    ----------
    kernels, positions, function, size, scales, lateral, tolerance
        As of `Varying`.

    Notes
    -----
    With the kernel K_p of place p, the bloom at p is the sum over q of glow(q) K_p(p - q), computed
    as the sum over k of w_k (K_k * glow).
    """

    gathers: ClassVar[bool] = True


def _argument_names(function: Function) -> list[str]:
    try:
        names = list(inspect.signature(function).parameters)
    except (TypeError, ValueError):
        return ["u", "v"]
    return names if names and _NAMED.issuperset(names) else ["u", "v"]


def _read_positions(positions: Any, rows: int, columns: int) -> Positions:
    """Return the x of the columns and the y of the rows, or raise TypeError or ValueError."""
    try:
        pair = [check_floats("positions", line) for line in positions]
        if [len(line) for line in pair] == [columns, rows]:
            return _increasing(pair[0], pair[1])
    except TypeError:
        pass
    try:
        points = plain_array(positions, "positions").astype(np.float64)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.shape in ((rows, columns, 2), (rows * columns, 2)):
        grid = points.reshape(rows, columns, 2)
        if (grid[..., 0] == grid[:1, :, 0]).all() and (grid[..., 1] == grid[:, :1, 1]).all():
            return _increasing(tuple(grid[0, :, 0].tolist()), tuple(grid[:, 0, 1].tolist()))
        raise ValueError(
            "positions: they are not a grid, in which each row has one y and each column one x"
        )
    raise ValueError(
        f"positions: neither (xs, ys) with {columns} and {rows} numbers nor (x, y) of each of "
        f"{rows} x {columns} kernels"
    )


def _increasing(xs: tuple[float, ...], ys: tuple[float, ...]) -> Positions:
    for name, line in (("x", xs), ("y", ys)):
        if any(not low < high for low, high in itertools.pairwise(line)):
            raise ValueError(f"positions: the {name} of {line!r} do not increase")
    return xs, ys


def _of_photutils(model: Any) -> tuple[Array, Positions]:
    """Return kernels and positions of a GriddedPSFModel, in pixels of the picture."""
    points = np.asarray(model.grid_xypos, np.float64)
    xs, ys = np.unique(points[:, 0]), np.unique(points[:, 1])
    oversampling = np.broadcast_to(np.asarray(model.oversampling), 2)
    # The model's stamp has its centre between pixels or on one; a kernel's centre is on one.
    sides = [
        2 * (side // (2 * int(factor))) + 1
        for side, factor in zip(model.data.shape[1:], oversampling, strict=True)
    ]
    dy, dx = (np.arange(side) - side // 2 for side in sides)
    kernels = np.zeros((len(ys), len(xs), *sides))
    for j, y in enumerate(ys):
        for i, x in enumerate(xs):
            across, down = np.meshgrid(x + dx, y + dy)
            kernels[j, i] = model.evaluate(across, down, 1.0, x, y)
    return kernels, (tuple(xs.tolist()), tuple(ys.tolist()))
