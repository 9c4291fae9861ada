"""Write the tables of the laws for the page on `vkbloom check`; called by conf.py."""

from __future__ import annotations

import math
from pathlib import Path

from vkbloom.testing._laws.table import LAWS


def write(page: Path) -> None:
    """Write what each law says and why a right bloom may break it, then its figures and limits."""
    lines = ["| law | what it says | why a bloom that is no fault may break it |", "|---|---|---|"]
    for law in LAWS.values():
        lines.append(f"| `{law.name}` | {law.sentence} | {law.why} |")
    lines += ["", "| law | figure | what it is | limit |", "|---|---|---|---|"]
    for law in LAWS.values():
        for name, figure in law.figures.items():
            limit = "" if math.isinf(figure.limit) else f"{figure.limit:g}"
            lines.append(f"| `{law.name}` | `{name}` | {figure.words} | {limit} |")
    page.write_text("\n".join((*lines, "")), encoding="utf-8")
