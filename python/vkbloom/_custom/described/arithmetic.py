"""Expressions of descriptions: what an engine's CPU code computes of sizes, levels and settings."""

from __future__ import annotations

import ast
import functools
import math
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from vkbloom._custom.described.tables import shown

#: Numbers; a single one stands for as many as are needed.
Numbers = tuple[float, ...]
Expression = ast.expr

MAX_CHARACTERS: Final = 1000
MAX_ZEROS: Final = 1 << 16
ZEROS: Final = "zeros"
#: Of operations within others.
MAX_DEPTH: Final = 100
#: Exponents that give no integer or float of great size.
MAX_VALUE: Final = 1e30


class ArithmeticFault(ValueError):
    """An expression that is not valid, or has no value; `line`: where it is, if that is known."""

    line: int | None = None


class Scope(Protocol):
    """What names mean."""

    def number(self, name: str) -> Numbers:
        """Return the value of a name; raise ArithmeticFault if it is none."""

    def size(self, source: Source) -> tuple[int, int]:
        """Return width and height of an image; raise ArithmeticFault if there is none."""


class Source(tuple[str, Expression | None]):
    """The name of an image, and the expression of its level."""

    __slots__ = ()

    @property
    def name(self) -> str:
        """The name without the level."""
        return self[0]

    @property
    def level(self) -> Expression | None:
        """The level; None if the image is not one of several."""
        return self[1]


def _clamp(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


#: Functions of numbers, with how many they take.
FUNCTIONS: Final[Mapping[str, tuple[int, Callable[..., float]]]] = {
    "abs": (1, abs),
    "ceil": (1, math.ceil),
    "clamp": (3, _clamp),
    "exp": (1, math.exp),
    "exp2": (1, lambda x: 2.0**x),
    "floor": (1, math.floor),
    "log": (1, math.log),
    "log2": (1, math.log2),
    "max": (2, max),
    "min": (2, min),
    "round": (1, round),
    "sqrt": (1, math.sqrt),
}
#: Functions of an image: its size, 1 / size, and their parts.
SIZES: Final[Mapping[str, Callable[[int, int], Numbers]]] = {
    "size": lambda width, height: (width, height),
    "texel": lambda width, height: (1 / width, 1 / height),
    "width": lambda width, height: (width,),
    "height": lambda width, height: (height,),
}
_OPERATORS: Final[Mapping[type, Callable[[float, float], float]]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.FloorDiv: lambda a, b: a // b,
    ast.Mod: lambda a, b: a % b,
    ast.Pow: lambda a, b: a**b,
}
_COMPARISONS: Final[Mapping[type, Callable[[float, float], bool]]] = {
    ast.Lt: lambda a, b: a < b,
    ast.LtE: lambda a, b: a <= b,
    ast.Gt: lambda a, b: a > b,
    ast.GtE: lambda a, b: a >= b,
    ast.Eq: lambda a, b: a == b,
    ast.NotEq: lambda a, b: a != b,
}


@functools.lru_cache(maxsize=1024)
def parse(text: str) -> Expression:
    """Parse an expression; raise ArithmeticFault if it is none."""
    if len(text) > MAX_CHARACTERS:
        raise ArithmeticFault(f"the expression has more than {MAX_CHARACTERS} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        _check(tree)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, ArithmeticFault):
            raise
        raise ArithmeticFault(f"{shown(text)} is not an expression") from None
    return tree


def source_of(text: str) -> Source:
    """Parse the name of an image, with or without a level: down, down[level - 1]."""
    tree = parse(text)
    if not _is_source(tree):
        raise ArithmeticFault(
            f"{shown(text)} is not the name of an image, such as glow or down[level]"
        )
    return _as_source(tree)


def _text(tree: Expression) -> str:
    """Return an expression as messages show it."""
    try:
        return ast.unparse(tree)
    except RecursionError:
        return "an expression"


def _is_source(tree: Expression) -> bool:
    return isinstance(tree, ast.Name) or (
        isinstance(tree, ast.Subscript) and isinstance(tree.value, ast.Name)
    )


def _as_source(tree: Expression) -> Source:
    if isinstance(tree, ast.Subscript):
        assert isinstance(tree.value, ast.Name)
        return Source((tree.value.id, tree.slice))
    assert isinstance(tree, ast.Name)
    return Source((tree.id, None))


def _check(tree: Expression) -> None:
    """Check that a tree has nothing but arithmetic, and ends before recursion must."""
    waiting = [(tree, 0)]
    for node, depth in waiting:
        if depth > MAX_DEPTH:
            raise ArithmeticFault(f"the expression nests more than {MAX_DEPTH} operations")
        waiting += [(part, depth + 1) for part in _parts(node)]


def _parts(tree: Expression) -> list[Expression]:  # noqa: PLR0911  one for each kind
    """Return the expressions in an expression; raise ArithmeticFault if it is not arithmetic."""
    match tree:
        case ast.Constant(value=bool() | int() | float()) | ast.Name():
            return []
        case ast.BinOp() if type(tree.op) in _OPERATORS:
            return [tree.left, tree.right]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Not()):
            return [tree.operand]
        case ast.BoolOp():
            return tree.values
        case ast.Compare() if all(type(op) in _COMPARISONS for op in tree.ops):
            return [tree.left, *tree.comparators]
        case ast.IfExp():
            return [tree.test, tree.body, tree.orelse]
        case ast.Attribute(attr="x" | "y" | "z" | "w"):
            return [tree.value]
        case ast.Subscript(value=ast.Name()):
            return [tree.slice]
        case ast.Call(func=ast.Name(), keywords=[]):
            return _arguments(tree)
    raise ArithmeticFault(f"{_text(tree)!r} is not arithmetic")


def _arguments(tree: ast.Call) -> list[Expression]:
    assert isinstance(tree.func, ast.Name)
    name = tree.func.id
    if name in SIZES:
        if len(tree.args) != 1 or not _is_source(tree.args[0]):
            raise ArithmeticFault(f"{_text(tree)!r}: {name} takes an image, such as glow")
    elif name == ZEROS:
        if len(tree.args) != 1:
            raise ArithmeticFault(f"{ZEROS} takes a number, of how many there are")
    elif name not in FUNCTIONS:
        known = ", ".join((*SIZES, *FUNCTIONS, ZEROS))
        raise ArithmeticFault(f"{name!r} is not a function; known are {known}")
    elif len(tree.args) != FUNCTIONS[name][0]:
        raise ArithmeticFault(f"{name} takes {FUNCTIONS[name][0]} numbers, not {len(tree.args)}")
    return list(tree.args)


def names_in(tree: Expression) -> tuple[set[str], set[str]]:
    """Return the names of numbers and those of images in an expression."""
    if _is_source(tree):
        source = _as_source(tree)
        if source.level is None:
            return {source.name}, set()
        return names_in(source.level)[0], {source.name}
    numbers: set[str] = set()
    images: set[str] = set()
    if isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name) and tree.func.id in SIZES:
        source = _as_source(tree.args[0])
        inner = (set(), set()) if source.level is None else names_in(source.level)
        return inner[0], inner[1] | {source.name}
    for part in _parts(tree):
        more, other = names_in(part)
        numbers |= more
        images |= other
    return numbers, images


def evaluate(tree: Expression, scope: Scope) -> Numbers:
    """Return the value of an expression; raise ArithmeticFault if it has none."""
    try:
        value = _evaluate(tree, scope)
    except RecursionError:
        raise ArithmeticFault(f"{_text(tree)!r} nests too many operations") from None
    except (ZeroDivisionError, OverflowError, ValueError, TypeError) as error:
        if isinstance(error, ArithmeticFault):
            raise
        cause = "it is too large" if isinstance(error, OverflowError) else str(error)
        raise ArithmeticFault(f"{_text(tree)!r} has no value: {cause}") from None
    if not all(math.isfinite(each) for each in value):
        raise ArithmeticFault(f"{_text(tree)!r} has no finite value")
    return value


def _evaluate(tree: Expression, scope: Scope) -> Numbers:  # noqa: PLR0911  one for each kind
    match tree:
        case ast.Constant():
            return (_checked(tree.value),)  # type: ignore[arg-type]
        case ast.Name():
            return scope.number(tree.id)
        case ast.BinOp():
            operator = _OPERATORS[type(tree.op)]
            return _each(operator, _evaluate(tree.left, scope), _evaluate(tree.right, scope))
        case ast.UnaryOp():
            value = _evaluate(tree.operand, scope)
            if isinstance(tree.op, ast.Not):
                return tuple(float(not each) for each in value)
            return tuple(-each for each in value) if isinstance(tree.op, ast.USub) else value
        case ast.BoolOp():
            wanted = isinstance(tree.op, ast.Or)
            found = (any(_evaluate(each, scope)) == wanted for each in tree.values)
            return (float(any(found) == wanted),)
        case ast.Compare():
            values = [_evaluate(each, scope)[0] for each in (tree.left, *tree.comparators)]
            rows = zip(tree.ops, values, values[1:], strict=False)
            return (float(all(_COMPARISONS[type(op)](a, b) for op, a, b in rows)),)
        case ast.IfExp():
            chosen = tree.body if any(_evaluate(tree.test, scope)) else tree.orelse
            return _evaluate(chosen, scope)
        case ast.Attribute():
            value, index = _evaluate(tree.value, scope), "xyzw".index(tree.attr)
            if index >= len(value):
                raise ArithmeticFault(f"{_text(tree)!r}: there is no {tree.attr}")
            return (value[index],)
        case ast.Call():
            assert isinstance(tree.func, ast.Name)
            if tree.func.id in SIZES:
                return SIZES[tree.func.id](*scope.size(_as_source(tree.args[0])))
            given = [_evaluate(each, scope) for each in tree.args]
            return _zeros(*given) if tree.func.id == ZEROS else _call(tree.func.id, given)
    raise ArithmeticFault(f"{_text(tree)!r} is an image, not a number")


def _call(name: str, values: list[Numbers]) -> Numbers:
    return _each(FUNCTIONS[name][1], *values)


def _zeros(count: Numbers) -> Numbers:
    """Return so many zeros, as content of a buffer."""
    if len(count) != 1 or not 1 <= count[0] <= MAX_ZEROS:
        raise ArithmeticFault(f"{ZEROS}: {count[0]:g} is out of range, 1 to {MAX_ZEROS}")
    return (0.0,) * int(count[0])


def _each(function: Callable[..., float], *values: Numbers) -> Numbers:
    """Apply a function to numbers at the same places; a single number is at all places."""
    count = max(len(value) for value in values)
    if any(len(value) not in (1, count) for value in values):
        raise ArithmeticFault(f"{' and '.join(str(len(v)) for v in values)} numbers do not match")
    rows = [value * count if len(value) == 1 else value for value in values]
    return tuple(_checked(function(*row)) for row in zip(*rows, strict=True))


def _checked(value: float) -> float:
    if isinstance(value, complex) or abs(value) > MAX_VALUE:
        raise ArithmeticFault("a number is too large, or not real")
    return float(value)
