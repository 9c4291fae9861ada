"""Write the tables of the laws for the page on `vkbloom check`; called by conf.py."""

from __future__ import annotations

import math
from pathlib import Path

from vkbloom.testing._laws.table import EXPOSURE_LAWS, LAWS


def write(page: Path, kind: str = "bloom") -> None:
    """Write what each law says and why a right one may break it, then its figures and limits.

    - `kind`: Of which the laws are: "bloom" or "exposure".
    """
    laws = LAWS if kind == "bloom" else EXPOSURE_LAWS
    why = f"why {'an' if kind == 'exposure' else 'a'} {kind} that is no fault may break it"
    lines = [f"| law | what it says | {why} |", "|---|---|---|"]
    for law in laws.values():
        lines.append(f"| `{law.name}` | {law.sentence} | {law.why} |")
    lines += ["", "| law | figure | what it is | limit |", "|---|---|---|---|"]
    for law in laws.values():
        for name, figure in law.figures.items():
            limit = "" if math.isinf(figure.limit) else f"{figure.limit:g}"
            lines.append(f"| `{law.name}` | `{name}` | {figure.words} | {limit} |")
    page.write_text("\n".join((*lines, "")), encoding="utf-8")
