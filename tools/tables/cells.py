"""Tables in Markdown, and the presets that have a row."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import vkbloom


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return rows of cells under a head."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


#: The presets whose rows are measured; all of them if it is empty.
ONLY: list[str] = []


def shown_presets() -> list[str]:
    """Return the names of the presets that have a row."""
    return ONLY or [*vkbloom.presets]


def merge_rows(old: str, new: str) -> str:
    """Return a page of tables with the rows of another one, each by the name in its first cell.

    Raises ValueError if it has other columns.
    """
    parts = old.split("\n\n")
    added = new.split("\n\n")
    for place, part in enumerate(added[1:], 1):
        head, rule, *rows = parts[place].splitlines()
        other_head, _, *more = part.splitlines()
        if head != other_head:
            raise ValueError(f"{other_head} is not the head of the table, {head}")
        named = {row.split("|")[1]: row for row in (*rows, *more)}
        parts[place] = "\n".join((head, rule, *named.values()))
    return "\n\n".join(parts).rstrip("\n") + "\n"


def format_figure(number: float | None, factor: float = 1.0) -> str:
    """Return a figure to two digits; "0" for what is nearly nothing, "none" for none and NaN."""
    if number is None or math.isnan(number):
        return "none"
    value = float(f"{factor * number:.2g}")
    return "0" if abs(value) < 1e-3 else f"{value:g}"
