"""Arrays that remember how they were computed, so that a derivative can be taken backwards.

NumPy's functions call `Traced.__array_ufunc__` and `Traced.__array_function__` for these arrays. So
the formulas of the reference compute with them unchanged. Each operation has a rule: from the
derivative with respect to its result to those with respect to its arguments.

At a kink, such as an end of a clamp or a maximum with a constant, the derivative is the mean of
those to both sides. Where the differences to both sides agree, this is what they agree on. The
mean is that of whole chains, each followed to one side: a second clamp at the same place does not
halve it again. Equal arrays or channels have equal shares of a maximum. An operation passes nothing
where its derivative is infinite or undefined, such as that of a root at 0.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# From the derivative by the result to the derivative by one argument.
Rule = Callable[[Array], Array]
# At kinks the rules of growing and of falling arguments.
Sides = tuple[Rule, Rule]

_order = itertools.count()


class _Node:
    """One result: the nodes that it was computed from, each with its rule."""

    __slots__ = ("arguments", "order")

    def __init__(self, arguments: Sequence[tuple[_Node, Rule | Sides]] = ()) -> None:
        self.arguments = arguments
        self.order = next(_order)


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of float64 with the node of its computation."""

    def __init__(self, value: Any, node: _Node | None = None) -> None:
        self.value: Array = np.asarray(value, np.float64)
        self.node = node or _Node()

    shape = property(lambda self: self.value.shape)
    ndim = property(lambda self: self.value.ndim)
    dtype = property(lambda self: self.value.dtype)

    def __len__(self) -> int:
        return len(self.value)

    def __bool__(self) -> bool:
        return bool(self.value)

    def __trunc__(self) -> int:
        return math.trunc(self.value.item())

    def __iter__(self) -> Iterator[Traced]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: Any) -> Traced:
        value = self.value[index]

        def back(derivative: Array) -> Array:
            result = np.zeros_like(self_value)
            np.add.at(result, index, derivative)
            return result

        self_value = self.value
        return _trace(value, (self, back))

    def __setitem__(self, index: Any, part: Any) -> None:
        """Replace a part. The node before stays as it was, for what was computed from it."""
        value = self.value.copy()
        value[index] = value_of(part)
        shape = value[index].shape

        def back(derivative: Array) -> Array:
            rest = derivative.copy()
            rest[index] = 0
            return rest

        before = Traced(self.value, self.node)
        new = _trace(value, (before, back), (part, lambda d: _sum_to(d[index], np.shape(part))))
        assert value[index].shape == shape
        self.value, self.node = new.value, new.node

    def swapaxes(self, first: int, second: int) -> Traced:
        """Exchange two axes."""
        return _trace(
            self.value.swapaxes(first, second), (self, lambda d: d.swapaxes(first, second))
        )

    def reshape(self, *shape: Any) -> Traced:
        """Give the array another shape."""
        return _trace(self.value.reshape(*shape), (self, lambda d: d.reshape(self.value.shape)))

    def astype(self, dtype: Any) -> Traced:
        """Return the array itself: all are of float64."""
        return self

    def sum(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Add along axes."""
        total = np.sum(self.value, axis=axis, keepdims=True)
        kept = total if keepdims else np.sum(self.value, axis=axis)
        shape = self.value.shape
        return _trace(kept, (self, lambda d: np.broadcast_to(d.reshape(total.shape), shape)))

    def mean(self, axis: Any = None, keepdims: bool = False) -> Traced:
        """Average along axes."""
        total = self.sum(axis, keepdims)
        return cast("Traced", total / (self.value.size / total.value.size))

    def max(self, axis: int, keepdims: bool = False) -> Traced:
        """Return the largest along an axis."""
        return self._extreme(np.max, axis, keepdims)

    def min(self, axis: int, keepdims: bool = False) -> Traced:
        """Return the smallest along an axis."""
        return self._extreme(np.min, axis, keepdims)

    def _extreme(self, function: Callable[..., Array], axis: int, keepdims: bool) -> Traced:
        extreme = function(self.value, axis=axis, keepdims=True)
        share = (self.value == extreme).astype(np.float64)
        share /= share.sum(axis=axis, keepdims=True)
        value = extreme if keepdims else function(self.value, axis=axis)
        return _trace(value, (self, lambda d: share * d.reshape(extreme.shape)))

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        values = [value_of(part) for part in inputs]
        if method != "__call__":
            return NotImplemented
        if ufunc in _FLAT:
            return ufunc(*values)
        if ufunc not in _UFUNCS:
            return NotImplemented
        with np.errstate(all="ignore"):
            result = ufunc(*values)
            if ufunc is np.matmul:
                return _trace(result, (inputs[0], lambda d: d @ values[1].T))
            factors = _UFUNCS[ufunc](result, *values)
        apart = None
        if ufunc in _KINKS and not (
            len(inputs) == 2 and all(isinstance(x, Traced) for x in inputs)
        ):
            ties = np.equal(*values) if len(values) == 2 else np.equal(values[0], 0)
            apart = _KINKS[ufunc] * ties if ties.any() else None
        return _trace(
            result,
            *(
                (part, _scale(part, factor, apart))
                for part, factor in zip(inputs, factors, strict=True)
            ),
        )

    def __array_function__(
        self, function: Callable[..., Any], types: Any, args: Any, kwargs: Mapping[str, Any]
    ) -> Any:
        if function in _FLAT_FUNCTIONS:
            return function(*map(value_of, args), **kwargs)
        if function not in _FUNCTIONS:
            return NotImplemented
        return _FUNCTIONS[function](*args, **kwargs)


def value_of(array: Any) -> Any:
    """Return the value of an array, traced or not."""
    return array.value if isinstance(array, Traced) else array


def operation(value: Any, *arguments: tuple[Any, Rule | Sides]) -> Any:
    """Return the result of an operation on arrays, some of which may be traced.

    Each argument has its rule. The result is traced only if an argument is.
    """
    if not any(isinstance(argument, Traced) for argument, _ in arguments):
        return value
    return _trace(value, *arguments)


def contiguous(array: Array) -> Array:
    """Return the array, traced or not, in C order."""
    value = value_of(array)
    # Arrays of other libraries have no order.
    ordered = np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value
    same: Array = operation(ordered, (array, lambda d: d))
    return same


def join_curves(position: Any, at: float, below: Any, above: Any) -> Any:
    """Return one curve up to a place and another above it, which have equal values there."""
    value = value_of(position)
    falling, growing = np.less_equal(value, at), np.less(value, at)
    return operation(
        np.where(falling, value_of(below), value_of(above)),
        (below, (_choose(below, growing), _choose(below, falling))),
        (above, (_choose(above, ~growing), _choose(above, ~falling))),
    )


def _trace(value: Any, *arguments: tuple[Any, Rule | Sides]) -> Traced:
    return Traced(
        value, _Node([(part.node, rule) for part, rule in arguments if isinstance(part, Traced)])
    )


def gradients(results: Sequence[tuple[Traced, Array]], inputs: Sequence[Traced]) -> list[Array]:
    """Return the derivative of sum over the results of (result . cotangent) by each input."""
    growing, kinked = _gradients(results, inputs, 0)
    if not kinked:
        return growing
    falling, _ = _gradients(results, inputs, 1)
    return [(first + second) / 2 for first, second in zip(growing, falling, strict=True)]


def _gradients(
    results: Sequence[tuple[Traced, Array]], inputs: Sequence[Traced], side: int
) -> tuple[list[Array], bool]:
    """Return the derivatives to one side of all kinks, and whether there are any."""
    derivatives: dict[_Node, Array] = {}
    waiting: dict[int, _Node] = {}

    def add(node: _Node, derivative: Array) -> None:
        waiting[node.order] = node
        known = derivatives.get(node)
        derivatives[node] = derivative if known is None else known + derivative

    wanted = {part.node for part in inputs}
    for result, cotangent in results:
        add(result.node, cotangent)
    results_of_inputs: dict[_Node, Array] = {}
    kinked = False
    while waiting:
        node = waiting.pop(max(waiting))
        derivative = derivatives.pop(node)
        if node in wanted:
            results_of_inputs[node] = derivative
        for argument, rule in node.arguments:
            sides = rule if isinstance(rule, tuple) else (rule, rule)
            kinked = kinked or isinstance(rule, tuple)
            add(argument, sides[side](derivative))
    return [results_of_inputs.get(part.node, np.zeros(part.shape)) for part in inputs], kinked


def _times(derivative: Array, factor: Any) -> Array:
    """Return the product; 0 where the factor is not finite."""
    product: Array = derivative * np.where(np.isfinite(factor), factor, 0.0)
    return product


def _scale(part: Any, factor: Any, apart: Any) -> Rule | Sides:
    """Return the rules of an argument by its factor, which differs so much on both sides."""

    def rule(scale: Any) -> Rule:
        return lambda d: _sum_to(_times(d, scale), np.shape(part))

    return rule(factor) if apart is None else (rule(factor + apart), rule(factor - apart))


def _choose(part: Any, mask: Any) -> Rule:
    return lambda d: _sum_to(np.where(mask, d, 0.0), np.shape(part))


def _sum_to(derivative: Array, shape: tuple[int, ...]) -> Array:
    """Return the derivative by an argument that NumPy has broadcast from a shape."""
    extra = derivative.ndim - len(shape)
    derivative = derivative.sum(axis=tuple(range(extra)))
    axes = tuple(i for i, side in enumerate(shape) if side == 1 and derivative.shape[i] != 1)
    total: Array = derivative.sum(axis=axes, keepdims=True)
    return total


def _power(result: Array, base: Any, exponent: Any) -> tuple[Any, Any]:
    base, exponent = np.asarray(base, np.float64), np.asarray(exponent, np.float64)
    zero = base == 0
    by_base = np.where(zero & (exponent != 1), 0.0, exponent * base ** (exponent - 1))
    return by_base, np.where(base > 0, result * np.log(np.where(base > 0, base, 1.0)), 0.0)


def _larger(first: Any, second: Any) -> Any:
    return np.greater(first, second) + 0.5 * np.equal(first, second)


# Their results are counts or conditions, without a derivative.
_FLAT = {
    *(np.greater, np.greater_equal, np.less, np.less_equal, np.equal, np.not_equal),
    *(np.isfinite, np.floor, np.ceil, np.sign, np.logical_and, np.logical_or),
}
_FLAT_FUNCTIONS = {np.shape, np.zeros_like, np.ndim, np.size}

# For each argument the factor that makes its derivative from that of the result.
_UFUNCS: Mapping[np.ufunc, Callable[..., tuple[Any, ...]]] = {
    np.add: lambda r, a, b: (1.0, 1.0),
    np.subtract: lambda r, a, b: (1.0, -1.0),
    np.multiply: lambda r, a, b: (b, a),
    np.divide: lambda r, a, b: (np.divide(1, b), np.divide(-r, b)),
    np.negative: lambda r, a: (-1.0,),
    np.positive: lambda r, a: (1.0,),
    np.absolute: lambda r, a: (np.sign(a),),
    np.maximum: lambda r, a, b: (_larger(a, b), _larger(b, a)),
    np.minimum: lambda r, a, b: (_larger(b, a), _larger(a, b)),
    np.power: _power,
    np.square: lambda r, a: (2 * a,),
    np.sqrt: lambda r, a: (np.divide(0.5, r),),
    np.exp: lambda r, a: (r,),
    np.exp2: lambda r, a: (r * math.log(2),),
    np.expm1: lambda r, a: (r + 1,),
    np.log: lambda r, a: (np.divide(1, a),),
    np.log2: lambda r, a: (np.divide(1 / math.log(2), a),),
    np.radians: lambda r, a: (math.pi / 180,),
    np.sin: lambda r, a: (np.cos(a),),
    np.cos: lambda r, a: (-np.sin(a),),
    np.hypot: lambda r, a, b: (np.divide(a, r), np.divide(b, r)),
    np.matmul: lambda r, a, b: (),
}


# By how much the factors of a growing argument are above their means at a kink.
_KINKS: Mapping[np.ufunc, float] = {np.maximum: 0.5, np.minimum: -0.5, np.absolute: 1.0}


def _where(condition: Any, first: Any, second: Any) -> Any:
    mask = value_of(condition)
    value = np.where(mask, value_of(first), value_of(second))
    return operation(
        value, (first, _choose(first, mask)), (second, _choose(second, np.logical_not(mask)))
    )


def _clip(array: Any, low: Any, high: Any) -> Any:
    value, least, most = map(value_of, (array, low, high))
    above, from_low, below, to_high = value > least, value >= least, value < most, value <= most
    growing, falling = _choose(array, from_low & below), _choose(array, above & to_high)
    at_ends = np.any((above != from_low) | (below != to_high))
    return operation(
        np.clip(value, least, most),
        (array, (growing, falling) if at_ends else growing),
        (low, (_choose(low, ~above), _choose(low, ~from_low))),
        (high, (_choose(high, ~to_high), _choose(high, ~below))),
    )


def _concatenate(parts: Sequence[Any], axis: int = 0) -> Any:
    ends = np.cumsum([np.shape(part)[axis] for part in parts])

    def rule(index: int) -> Rule:
        start = ends[index - 1] if index else 0
        return lambda d: np.take(d, np.arange(start, ends[index]), axis=axis)

    value = np.concatenate([value_of(part) for part in parts], axis=axis)
    return operation(value, *((part, rule(i)) for i, part in enumerate(parts)))


def _pad(array: Any, widths: Any, mode: str = "constant") -> Any:
    indices = np.arange(array.value.size).reshape(array.shape)
    # Beside the array, constants are 0 and have no place.
    options: dict[str, Any] = {"constant_values": -1} if mode == "constant" else {}
    indices = np.pad(indices, widths, mode, **options)  # type: ignore[call-overload]
    value = np.append(array.value.ravel(), 0.0)[indices]

    def back(derivative: Array) -> Array:
        kept = indices.ravel() >= 0
        sums = np.bincount(
            indices.ravel()[kept], derivative.ravel()[kept], minlength=array.value.size
        )
        return sums.reshape(array.shape)

    return _trace(value, (array, back))


def _polyval(coefficients: Sequence[float], x: Any) -> Any:
    value = np.polyval(coefficients, value_of(x))
    slope = np.polyval(np.polyder(np.array(coefficients)), value_of(x))
    return operation(value, (x, lambda d: _times(d, slope)))


_FUNCTIONS: Mapping[Callable[..., Any], Callable[..., Any]] = {
    np.where: _where,
    np.clip: _clip,
    np.concatenate: _concatenate,
    np.pad: _pad,
    np.polyval: _polyval,
    np.sum: lambda array, axis=None, keepdims=False: array.sum(axis, keepdims),
}
