"""The table of the laws of exposures: which engine breaks which, and by how much."""

from __future__ import annotations

from typing import Any

from cells import format_figure, table

import vkbloom
from vkbloom import testing
from vkbloom.testing._laws.table import EXPOSURE_LAWS

#: By default, Post Processing v2 has limits that leave it nothing to do.
_EXPOSURES = {
    name: vkbloom.PostProcessingExposure(minimum=-9, maximum=9) if name == "ppv2" else name
    for name in vkbloom.exposures
    if name != "fixed"
}


def laws(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return which exposures hold each law, and which break it, with their figures."""
    bloom = vkbloom.Pyramid(bloom=False)
    rows: dict[str, tuple[list[str], list[str]]] = {}
    for name, exposure in _EXPOSURES.items():
        if quick and name == "hdrp_automatic":  # takes ten times as long as the others
            continue

        def meter(image: Any, *, dt: float, state: Any, exposure: Any = exposure) -> Any:
            how: Any = {"exposure": exposure, "framebuffers": ()}
            return renderer.apply(image, bloom, dt=dt, state=state, **how)

        for row in testing.report(meter).rows:
            held, broken = rows.setdefault(row.name, ([], []))
            if row.held:
                held.append(f"`{name}`")
                continue
            limits = EXPOSURE_LAWS[row.name].limits
            figures = ", ".join(
                f"{figure} {format_figure(value)}"
                for figure, value in row.figures.items()
                if not value <= limits.get(figure, -1)
            )
            broken.append(f"`{name}` ({figures})")
    cells = (
        [f"`{law}`", *(", ".join(names) for names in sides)]
        for law, sides in rows.items()
        if any(sides)
    )
    return table(["law", "held by", "broken by"], cells)
