"""The table of the law `shimmer`: temporal anti-aliasing before the bloom, and after it."""

from __future__ import annotations

import dataclasses
from typing import Any, get_args

from cells import format_figure, table

import vkbloom
from vkbloom import testing
from vkbloom._settings.antialiasing import Order


def orders(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return how much the bloom of small lights flickers with each preset, in both orders."""
    # Not Bevy's, which is not black beside black.
    bloom = vkbloom.Pyramid(levels=4, format="rgba32float")
    rows = []
    for name in [*vkbloom.antialiasing][: 1 if quick else None]:
        cells = [f"`{name}`"]
        for order in get_args(Order):
            taa = dataclasses.replace(vkbloom.antialiasing[name], order=order)

            def step(image: Any, *, dt: float, state: Any, taa: Any = taa) -> vkbloom.Frames:
                how: Any = {"taa": taa, "state": state, "framebuffers": "final"}
                return renderer.apply(image, bloom, **how)

            (row,) = testing.report(step, laws=["shimmer"]).rows
            figures = [format_figure(row.figures[figure]) for figure in _FIGURES[:2]]
            cells += [*figures, "held" if row.held else "broken"]
        rows.append(cells)
    titles = [f"{figure}, {order}" for order in ("TAA first", "bloom first") for figure in _FIGURES]
    return table(["preset", *titles], rows)


_FIGURES = ("flicker", "kept", "law")
