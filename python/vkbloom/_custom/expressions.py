"""Expressions of sizes and conditions: reverse Polish notation in single precision."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

#: Of an expression. libplacebo 7.349 has 32, later versions 64.
MAX_TOKENS: Final = 64
SIZES: Final = {".width": 0, ".w": 0, ".height": 1, ".h": 1}
NUMBER: Final = re.compile(r"\d+(\.\d*)?([eE][+-]?\d+)?")
#: `=` holds within this share of the larger number.
EQUAL: Final = 1e-6

Stack = list[np.float32]


class ExpressionError(Exception):
    """An expression that has no value; the message says why."""


def equal(a: np.float32, b: np.float32) -> bool:
    """Return whether two numbers are equal within the tolerance."""
    return bool(abs(a - b) <= np.float32(EQUAL) * max(abs(a), abs(b)))


OPERATORS: Final[Mapping[str, Callable[[np.float32, np.float32], np.float32 | bool]]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "%": np.fmod,
    ">": lambda a, b: bool(a > b),
    "<": lambda a, b: bool(a < b),
    "=": equal,
}


@dataclasses.dataclass(frozen=True)
class Values:
    """What the words of an expression mean: sizes of textures, and values of parameters."""

    sizes: Mapping[str, tuple[int, int]]
    words: Mapping[str, float]


def tokens(text: str) -> list[str]:
    """Return the tokens of an expression; only blanks separate them."""
    words = [token for token in text.split(" ") if token]
    if len(words) > MAX_TOKENS:
        raise ExpressionError(f"{len(words)} tokens are more than {MAX_TOKENS}")
    return words


def evaluate(text: str, values: Values) -> float:
    """Return the value of an expression; all results must be finite."""
    stack: Stack = []
    with np.errstate(all="ignore"):
        for token in tokens(text):
            operation = push(stack, token, values)
            if operation and not np.isfinite(stack[-1]):
                raise ExpressionError(f"{operation} is not a finite number")
    return result_of(stack)


def check_syntax(text: str, values: Values) -> None:
    """Raise ExpressionError if an expression has no value; results may be infinite or NaN."""
    stack: Stack = []
    with np.errstate(all="ignore"):
        for token in tokens(text):
            push(stack, token, values)
    result_of(stack)


def result_of(stack: Stack) -> float:
    """Return the only value of a stack."""
    if len(stack) != 1:
        raise ExpressionError(f"{len(stack)} values are left, not 1")
    return float(stack[0])


def push(stack: Stack, token: str, values: Values) -> str:
    """Apply one token to the stack, and return the operation with its operands; "": it has none."""
    ending = next((ending for ending in SIZES if token.endswith(ending)), None)
    if ending:
        name = token.removesuffix(ending)
        if name not in values.sizes:
            known = ", ".join(sorted(values.sizes))
            raise ExpressionError(f"texture: {name!r} is not one of {known}")
        stack.append(np.float32(values.sizes[name][SIZES[ending]]))
    elif token[0] in OPERATORS:
        if len(stack) < 2:
            negative = "; write -1 as '0 1 -'" if len(token) > 1 and token[0] == "-" else ""
            raise ExpressionError(f"{token!r} needs two values before it{negative}")
        b, a = stack.pop(), stack.pop()
        stack.append(np.float32(OPERATORS[token[0]](a, b)))
        return f"{a:g} {b:g} {token[0]}"
    elif token[0] == "!":
        if not stack:
            raise ExpressionError("'!' needs a value before it")
        stack.append(np.float32(stack.pop() == 0))
    elif number := (NUMBER.match(token) if token[0] in "0123456789" else None):
        stack.append(np.float32(float(number[0])))
    elif token in values.words:
        stack.append(np.float32(values.words[token]))
    else:
        raise ExpressionError(unknown_word(token, values))
    return ""


def unknown_word(token: str, values: Values) -> str:
    """Return the message of a word that has no meaning."""
    if token[0] == ".":
        return f"{token!r} is not a number; numbers begin with a digit"
    if "\t" in token:
        return f"{token!r} has a tab; only blanks separate tokens"
    known = ", ".join(values.words) or "none"
    return (
        f"{token!r} is neither a number, an operator, a size (NAME.w, NAME.h) nor a PARAM ({known})"
    )


def round_half_away(value: float) -> int:
    """Round half away from zero."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))
