"""Blocks PARAM: the parameters of a custom method, which become fields of its settings."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Any, Final, Literal, get_args

from vkbloom._custom.blocks import Block, Directive

Number = Literal["float", "int", "uint"]
#: How GLSL sees the value: a member of the uniform block, a constant, or a macro.
Use = Literal["uniform", "constant", "define"]

NUMBERS: Final = {
    "float": re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?"),
    # The fraction of a whole number is ignored.
    "int": re.compile(r"[+-]?\d+(\.\d*)?"),
    "uint": re.compile(r"\+?\d+(\.\d*)?"),
}
RANGES: Final[dict[Number, tuple[float, float]]] = {
    "float": (-math.inf, math.inf),
    "int": (-(2**31), 2**31 - 1),
    "uint": (0, 2**32 - 1),
}


@dataclasses.dataclass(frozen=True)
class Param:
    """A parameter. `names` are those of an ENUM; its value is then the index of one."""

    name: str
    description: str
    number: Number
    use: Use
    low: float
    high: float
    default: float
    names: tuple[str, ...]
    line: int

    def plain(self, value: Any) -> float:
        """Return the number of a field's value, which is a name for an ENUM."""
        return self.names.index(value) if self.names else float(value)


def read_param(block: Block) -> Param:
    """Read a block PARAM."""
    name, first = block.head.identifier(), block.line
    number, use, is_enum = read_type(block)
    described = block.last("DESC")
    description = described.value if described else ""
    line, text = body_line(block)
    if is_enum:
        names = read_names(block)
        return Param(name, description, "int", use, 0, len(names) - 1, 0, names, first)
    low, high = RANGES[number]
    for limit in block.directives:
        if limit.name == "MINIMUM":
            low = read_number(limit, number)
        elif limit.name == "MAXIMUM":
            high = read_number(limit, number)
    if not text:
        raise block.fault(first, "the block has no default value")
    given = Directive(block.head.source, f"the default of {name}", text, line)
    default = read_number(given, number)
    if not low <= default <= high:
        raise given.fault(f"{default:g} is out of range, {low:g} to {high:g}")
    return Param(name, description, number, use, low, high, default, (), first)


def read_type(block: Block) -> tuple[Number, Use, bool]:
    """Return number and use of the parameter, and whether it is an ENUM."""
    declared = block.last("TYPE")
    if declared is None:
        raise block.fault(block.line, "the block has no //!TYPE")
    words = declared.value.split()
    uses: dict[str, Use] = {"DYNAMIC": "uniform", "CONSTANT": "constant"}
    if words == ["DEFINE"]:
        return "int", "define", False
    if words[:1] == ["ENUM"] and words[1:] in (["int"], ["DEFINE"]):
        return "int", "define" if words[1] == "DEFINE" else "uniform", True
    use = uses.get(words[0], "uniform") if words else "uniform"
    kinds = words[1:] if words and words[0] in uses else words
    for number in get_args(Number):
        if kinds == [number]:
            return number, use, False
    raise declared.refusal(
        "is not one of float, int, uint, DYNAMIC or CONSTANT with one of these, DEFINE, ENUM int, "
        "ENUM DEFINE"
    )


def body_line(block: Block) -> tuple[int, str]:
    """Return the body without blanks around it, and its line."""
    text = block.body.lstrip()
    skipped = block.body[: len(block.body) - len(text)]
    return block.body_line + skipped.count("\n"), text.rstrip()


def read_number(given: Directive, number: Number) -> float:
    """Read a number, which must be all of the value."""
    text = given.value
    if not NUMBERS[number].fullmatch(text):
        shown = text.partition("\n")[0]
        raise given.fault(f"{shown!r} is not a number of type {number}")
    value = float(text) if number == "float" else int(text.partition(".")[0])
    low, high = RANGES[number]
    if not (low <= value <= high) or not math.isfinite(value):
        raise given.fault(f"{text} is not a number of type {number}")
    return value


def read_names(block: Block) -> tuple[str, ...]:
    """Read the names of an ENUM, one on each line."""
    names: list[str] = []
    source = block.head.source
    for offset, text in enumerate(block.body.split("\n")):
        name, line = text.strip(), block.body_line + offset
        if not name:
            continue
        if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
            raise source.fault(line, f"ENUM: {name!r} is not a name; give one on each line")
        if name in names:
            raise source.fault(line, f"ENUM: {name!r} is given twice")
        names.append(name)
    if not names:
        raise block.fault(block.line, "the ENUM has no names")
    return tuple(names)
