"""Arrays of other libraries, on which NumPy's functions run as those of the array API standard.

NumPy calls `ForeignArray.__array_ufunc__` and `ForeignArray.__array_function__` for these arrays.
So formulas that are written for NumPy compute in another library, on its device, and that library
records its own derivatives. Numbers become float64. Operations change no array in place.

Where the derivative of a power or of a root is infinite or undefined, as that of a root at 0,
nothing passes.
"""

from __future__ import annotations

import functools
import inspect
import math
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar, cast

import numpy as np

from ._extras import import_extra

_Function = TypeVar("_Function", bound=Callable[..., Any])

# Those whose arrays the standard's attribute does not mark.
_LIBRARIES: Final = ("torch", "cupy")


def run_in_other_libraries(*names: str) -> Callable[[_Function], _Function]:
    """Return a decorator that makes a function take arrays of other libraries, and return such.

    `names` are the parameters that may be such arrays. If none is one, the function is called as it
    is. Else all arrays that it returns, alone or in a dict, are of that library, on the device of
    the first.
    """

    def decorate(function: _Function) -> _Function:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            __tracebackhide__ = True
            if not any(map(_is_foreign, (*args, *kwargs.values()))):
                return function(*args, **kwargs)
            try:
                bound = signature.bind(*args, **kwargs)
            except TypeError:
                # Python's own error names the function.
                return function(*args, **kwargs)
            others = {
                name: _wrap(part, name)
                for name, part in bound.arguments.items()
                if name in names and _is_foreign(part)
            }
            if not others:
                return function(*args, **kwargs)
            _check_library(others)
            bound.arguments.update(others)
            return next(iter(others.values())).unwrap(function(*bound.args, **bound.kwargs))

        return cast("_Function", call)

    return decorate


def _check_library(given: Mapping[str, ForeignArray]) -> None:
    """Raise TypeError unless arguments are of one library."""
    (name, first), *rest = given.items()
    for other, part in rest:
        if part.namespace is not first.namespace:
            raise TypeError(
                f"{other}: {_type(part.value)} is not of the library of {name}, "
                f"{_type(first.value)}"
            )


def _type(value: object) -> str:
    return f"{type(value).__module__}.{type(value).__qualname__}"


def _is_foreign(value: object) -> bool:
    """Whether an object is an array of a library with the functions of the standard."""
    if isinstance(value, np.ndarray | np.generic):
        return False
    library = type(value).__module__.partition(".")[0]
    return library in _LIBRARIES or hasattr(value, "__array_namespace__")


def _wrap(value: Any, name: str) -> ForeignArray:
    """Return an argument of another library as such an array."""
    purpose = f"{name}: the reference of a {_type(value)}"
    compat = import_extra("array_api_compat", "arrays", purpose)
    wrapped = ForeignArray(value, compat.array_namespace(value), compat.device(value))
    with warnings.catch_warnings():
        # JAX warns of it.
        warnings.simplefilter("ignore")
        has_doubles = wrapped.astype(np.float64).dtype == np.float64
    if not has_doubles:
        raise TypeError(
            f"{name}: {_type(value)} has no float64 here; turn it on: "
            'jax.config.update("jax_enable_x64", True)'
        )
    return wrapped


class ForeignArray(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of another library, with its namespace and device."""

    def __init__(self, value: Any, namespace: Any, device: Any) -> None:
        self.value, self.namespace, self.device = value, namespace, device

    shape = property(lambda self: tuple(self.value.shape))
    ndim = property(lambda self: len(self.value.shape))
    size = property(lambda self: math.prod(self.value.shape))

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy's dtype of the same name; TypeError if there is none, as for bfloat16."""
        try:
            return np.dtype(str(self.value.dtype).rpartition(".")[2])
        except TypeError:
            raise TypeError(
                f"{_type(self.value)}: {self.value.dtype} is not a dtype of NumPy; convert it to "
                "float32"
            ) from None

    def __array__(self, *args: Any, **kwargs: Any) -> Any:
        raise TypeError(
            f"{_type(self.value)}: temporal anti-aliasing, custom methods and kernels by a "
            "function run on NumPy's arrays only"
        )

    def __len__(self) -> int:
        return int(self.shape[0])

    def __bool__(self) -> bool:
        return bool(self.value)

    def __float__(self) -> float:
        return float(self.value)

    def __iter__(self) -> Iterator[ForeignArray]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: Any) -> ForeignArray:
        if isinstance(index, ForeignArray):
            return self._new(self.value[index.value])
        direct = _direct(index, self.shape)
        if direct is not None:
            return self._new(self.value[direct])
        if isinstance(index, tuple):
            places = np.arange(self.size).reshape(self.shape)[index]
            return self.reshape(-1)._take(places)
        return self._take(np.arange(len(self))[index])

    def __setitem__(self, index: Any, part: Any) -> None:
        """Replace a part. The value before stays as it was, for what was computed from it."""
        places = np.full(self.shape, -1)
        count = places[index].size
        places[index] = np.arange(count).reshape(places[index].shape)
        if count:
            new: Any = np.broadcast_to(part, np.shape(places[index])).reshape(-1)
            self.value = self.where(places >= 0, new[np.maximum(places, 0)], self).value

    def _take(self, places: Any) -> ForeignArray:
        """Return the elements at places along the first axis."""
        chosen = self.namespace.take(self.value, self._of(places.reshape(-1)), axis=0)
        return self._new(chosen).reshape(*places.shape, *self.shape[1:])

    def swapaxes(self, first: int, second: int) -> ForeignArray:
        """Exchange two axes."""
        axes = list(range(self.ndim))
        axes[first], axes[second] = axes[second], axes[first]
        return self._new(self.namespace.permute_dims(self.value, tuple(axes)))

    def reshape(self, *shape: int) -> ForeignArray:
        """Give the array another shape."""
        return self._new(self.namespace.reshape(self.value, shape))

    def astype(self, dtype: Any, copy: bool = True) -> ForeignArray:
        """Return the array with another dtype."""
        return self._new(self._cast(self.value, np.dtype(dtype).name))

    def copy(self) -> ForeignArray:
        """Return an array whose parts can be replaced."""
        return self._new(self.value)

    def sum(self, axis: Any = None, keepdims: bool = False) -> ForeignArray:
        """Add along axes."""
        return self._reduce("sum", axis, keepdims)

    def mean(self, axis: Any = None, keepdims: bool = False) -> ForeignArray:
        """Average along axes."""
        return self._reduce("mean", axis, keepdims)

    def max(self, axis: Any = None, keepdims: bool = False) -> ForeignArray:
        """Return the largest along axes."""
        return self._reduce("max", axis, keepdims)

    def min(self, axis: Any = None, keepdims: bool = False) -> ForeignArray:
        """Return the smallest along axes."""
        return self._reduce("min", axis, keepdims)

    def any(self, axis: Any = None, keepdims: bool = False) -> ForeignArray:
        """Return whether any along axes is not 0."""
        return self._new(self._condition(self))._reduce("any", axis, keepdims)

    def all(self, axis: Any = None, keepdims: bool = False) -> ForeignArray:
        """Return whether none along axes is 0."""
        return self._new(self._condition(self))._reduce("all", axis, keepdims)

    def _reduce(self, name: str, axis: Any, keepdims: bool) -> ForeignArray:
        value = self.value if name in ("any", "all") else self._number(self)
        return self._new(getattr(self.namespace, name)(value, axis=axis, keepdims=keepdims))

    def unwrap(self, results: Any) -> Any:
        """Return arrays, alone or in a dict, as those of the library, on the device of this one."""
        if isinstance(results, dict):
            return {name: self.unwrap(part) for name, part in results.items()}
        return self._of(results)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Return a result; `out` is not written to, as the caller takes the result."""
        function = _UFUNCS.get(ufunc, ufunc.__name__)
        if method != "__call__":
            raise self._lacks(f"{ufunc.__name__}.{method}")
        if callable(function):
            return function(self, *inputs)
        if not hasattr(self.namespace, function):
            raise self._lacks(ufunc.__name__)
        read = self._condition if ufunc in _LOGICAL else self._number
        return self._new(getattr(self.namespace, function)(*map(read, inputs)))

    def __array_function__(
        self, function: Callable[..., Any], types: Any, args: Any, kwargs: Mapping[str, Any]
    ) -> Any:
        if function not in _FUNCTIONS:
            raise self._lacks(function.__name__)
        return _FUNCTIONS[function](self, *args, **kwargs)

    def _lacks(self, name: str) -> TypeError:
        return TypeError(f"{_type(self.value)}: the reference has no {name} of these arrays")

    def _new(self, value: Any) -> ForeignArray:
        return ForeignArray(value, self.namespace, self.device)

    def _of(self, part: Any) -> Any:
        """Return the library's array of a part of a formula."""
        if isinstance(part, ForeignArray):
            return part.value
        # A copy, since libraries share memory, but not that of arrays of negative strides.
        return self.namespace.asarray(np.array(part, order="C"), device=self.device)

    def _cast(self, value: Any, name: str) -> Any:
        dtype = getattr(self.namespace, name)
        return value if value.dtype == dtype else self.namespace.astype(value, dtype)

    def _number(self, part: Any) -> Any:
        """Return the library's array of float64, or of complex numbers."""
        value = self._of(part)
        return value if "complex" in str(value.dtype) else self._cast(value, "float64")

    def _condition(self, part: Any) -> Any:
        return self._cast(self._of(part), "bool")

    def where(self, condition: Any, first: Any, second: Any) -> ForeignArray:
        """Choose between numbers."""
        chosen = self._condition(condition), self._number(first), self._number(second)
        return self._new(self.namespace.where(*chosen))


def _direct(index: Any, shape: Sequence[int]) -> tuple[Any, ...] | None:
    """Return an index of the standard: of integers, slices with steps above 0, and new axes.

    None for other indices.
    """
    parts = index if isinstance(index, tuple) else (index,)
    if not all(
        part is None or part is Ellipsis or isinstance(part, int | np.integer | slice)
        for part in parts
    ):
        return None
    missing = len(shape) - sum(part is not None and part is not Ellipsis for part in parts)
    if Ellipsis not in parts:
        parts = (*parts, Ellipsis)
    at = parts.index(Ellipsis)
    parts = (*parts[:at], *[slice(None)] * missing, *parts[at + 1 :])
    sides = iter(shape)
    result: list[Any] = []
    for part in parts:
        if part is None:
            result.append(None)
            continue
        side = next(sides)
        if not isinstance(part, slice):
            result.append(operator.index(part))
            continue
        start, stop, step = part.indices(side)
        if step < 0:
            return None
        # Libraries may refuse places outside of the array, also of no elements.
        result.append(slice(start, stop, step) if start < stop else slice(0, 0))
    return tuple(result)


def _power(like: ForeignArray, base: Any, exponent: Any) -> ForeignArray:
    xp = like.namespace
    values, powers = like._number(base), like._number(exponent)
    if isinstance(exponent, ForeignArray) or not np.any(np.less(exponent, 1)):
        return like._new(xp.pow(values, powers))
    # Libraries pass the infinite derivative at 0 also to parts that were not chosen: 0 times it.
    is_zero = values == 0
    safe = like._new(xp.pow(xp.where(is_zero, xp.ones_like(values), values), powers))
    return like.where(like._new(is_zero), 0.0 ** np.asarray(exponent, np.float64), safe)


def _sqrt(like: ForeignArray, array: Any) -> ForeignArray:
    return _power(like, array, 0.5)


def _frexp(like: ForeignArray, array: Any) -> tuple[Any, Any]:
    """Return mantissa and exponent of finite numbers of at least 0."""
    guess = np.floor(np.log2(np.where(array > 0, array, 1.0)))
    # A logarithm beside an integer may round to it.
    guess = guess - (np.exp2(guess) > array) + (np.exp2(guess + 1) <= array)
    exponent = np.where(array > 0, guess + 1, 0.0)
    return array / np.exp2(exponent), exponent


_UFUNCS: Final[Mapping[np.ufunc, str | Callable[..., Any]]] = {
    np.absolute: "abs",
    np.power: _power,
    np.sqrt: _sqrt,
    np.exp2: lambda like, array: like._new(like.namespace.exp(like._number(array) * math.log(2))),
    np.radians: lambda like, array: array * (math.pi / 180),
    np.rint: "round",
    np.frexp: _frexp,
    np.invert: "logical_not",
    np.bitwise_and: "logical_and",
    np.bitwise_or: "logical_or",
}
_LOGICAL: Final = {
    *(np.invert, np.bitwise_and, np.bitwise_or),
    *(np.logical_not, np.logical_and, np.logical_or, np.logical_xor),
}


def _clip(like: ForeignArray, array: Any, low: Any, high: Any) -> Any:
    return np.minimum(np.maximum(array, low), high)


def _join(like: ForeignArray, parts: Sequence[Any], axis: int = 0) -> ForeignArray:
    return like._new(like.namespace.concat([like._number(part) for part in parts], axis=axis))


def _stack(like: ForeignArray, parts: Sequence[Any], axis: int = 0) -> ForeignArray:
    return like._new(like.namespace.stack([like._number(part) for part in parts], axis=axis))


def _pad(like: ForeignArray, array: Any, widths: Any, mode: str = "constant") -> ForeignArray:
    """Read the array at the places that NumPy gives; beside it, constants are 0."""
    places: Any = np.arange(array.size).reshape(array.shape)
    options: dict[str, Any] = {"constant_values": array.size} if mode == "constant" else {}
    places = np.pad(places, widths, mode, **options)  # type: ignore[call-overload]
    return _join(like, [array.reshape(-1), np.zeros(1)])._take(places)


def _polyval(like: ForeignArray, coefficients: Any, x: Any) -> Any:
    value: Any = np.zeros(())
    for coefficient in coefficients:
        value = value * x + coefficient
    return value


def _nan_to_num(like: ForeignArray, array: Any, nan: float, posinf: float) -> Any:
    """Replace NaN; infinity stays."""
    return np.where(np.isnan(array), nan, array)


def _transform(like: ForeignArray, array: Any, shape: Any, axes: tuple[int, int]) -> ForeignArray:
    fft = like.namespace.fft
    return like._new(fft.rfftn(like._number(array), s=tuple(shape), axes=axes))


def _transform_back(
    like: ForeignArray, array: Any, shape: Any, axes: tuple[int, int]
) -> ForeignArray:
    return like._new(like.namespace.fft.irfftn(like._of(array), s=tuple(shape), axes=axes))


def _norm(like: ForeignArray, array: Any, axis: int, keepdims: bool = False) -> Any:
    return np.sqrt((array * array).sum(axis=axis, keepdims=keepdims))


def _zeros_like(like: ForeignArray, array: Any) -> Any:
    return 0.0 * np.where(np.isfinite(array), array, 0.0)


_FUNCTIONS: Final[Mapping[Callable[..., Any], Callable[..., Any]]] = {
    np.where: ForeignArray.where,
    np.clip: _clip,
    np.concatenate: _join,
    np.stack: _stack,
    np.dstack: lambda like, parts: _join(
        like, [part if part.ndim == 3 else part[..., np.newaxis] for part in parts], axis=2
    ),
    np.pad: _pad,
    np.polyval: _polyval,
    np.nan_to_num: _nan_to_num,
    np.round: lambda like, array: np.rint(array),
    np.sum: lambda like, array, axis=None, keepdims=False: array.sum(axis, keepdims),
    np.cumsum: lambda like, array, axis: like._new(
        like.namespace.cumulative_sum(like._number(array), axis=axis)
    ),
    np.broadcast_to: lambda like, array, shape: like._new(
        like.namespace.broadcast_to(array.value, shape)
    ),
    np.zeros_like: _zeros_like,
    np.shape: lambda like, array: array.shape,
    np.ndim: lambda like, array: array.ndim,
    np.size: lambda like, array: array.size,
    np.fft.rfft2: _transform,
    np.fft.irfft2: _transform_back,
    np.linalg.norm: _norm,
}
