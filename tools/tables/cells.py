"""Tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return rows of cells under a head."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def format_figure(number: float | None, factor: float = 1.0) -> str:
    """Return a figure to two digits; "0" for what is nearly nothing, "none" for none and NaN."""
    if number is None or math.isnan(number):
        return "none"
    value = float(f"{factor * number:.2g}")
    return "0" if abs(value) < 1e-3 else f"{value:g}"
