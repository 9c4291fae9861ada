"""The settings of a description, which become fields."""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterator
from typing import Final

from vkbloom._custom.described.arithmetic import MAX_VALUE
from vkbloom._custom.described.tables import Table, shown
from vkbloom._custom.params import RANGES, Number, Param
from vkbloom._formats import MAX_FLOAT

#: Numbers that every expression can have: the number of a run in a loop, and of the frame before
#: this one.
LEVEL: Final = "level"
INDEX: Final = "index"

MAX_SETTINGS: Final = 64


def read_settings(table: Table) -> Iterator[Param]:
    """Return the settings of a description."""
    if len(list(table)) > MAX_SETTINGS:
        raise table.fault(f"settings: more than {MAX_SETTINGS}")
    for name in table:
        each = table.table(name)
        line = table.line(name)
        check_name(table, "settings", name)
        text = each.get("text", str, "")
        names = each.texts("choices")
        if "choices" in each:
            if len({*names}) < max(len(names), 1):
                each.refuse("choices", list(names), "are not different names")
            default = each.choice("default", names, names[0])
            last = len(names) - 1
            each.finish("a setting with choices")
            yield Param(name, text, "int", "uniform", 0, last, names.index(default), names, line)
            continue
        number = each.choice("type", ("float", "int"), "float")
        kinds = int if number == "int" else (int, float)
        if "default" not in each:
            raise table.fault(f"{name}: the setting has no default", name)
        value = each.get("default", kinds)
        read_number(each, "default", value, MAX_FLOAT)
        low, high = RANGES["int" if number == "int" else "float"]
        span = each.get("range", list, [low, high])
        if len(span) != 2 or not all(type(end) in (int, float) for end in span):
            each.refuse("range", span, "is not two numbers")
        for end in span:
            read_number(each, "range", end, math.inf)
        if not span[0] <= span[1]:
            each.refuse("range", span, "is not the least and the greatest value")
        if not span[0] <= value <= span[1]:
            each.refuse("default", value, f"is out of range, {span[0]} to {span[1]}")
        each.finish("a setting")
        kind: Number = "int" if number == "int" else "float"
        yield Param(
            name,
            text,
            kind,
            "uniform",
            max(low, float(span[0])),
            min(high, float(span[1])),
            float(value),
            (),
            line,
        )


def check_name(table: Table, what: str, name: str) -> None:
    """Check the name of a setting or of a number."""
    if not name.isidentifier() or keyword.iskeyword(name) or not name.isascii():
        raise table.fault(f"{what}: {shown(name)} is not a name", name)
    if name in (LEVEL, INDEX):
        raise table.fault(f"{what}: {name!r} is a name that expressions have; rename it", name)


def read_number(table: Table, key: str, value: float, most: float = MAX_VALUE) -> float:
    """Return a number that is not larger than another one."""
    try:
        number = float(value)
    except OverflowError:
        table.refuse(key, value, "is too large")
    if not abs(number) <= most:
        table.refuse(key, value, "is not a number" if math.isnan(number) else "is too large")
    return number
