"""The graph of a frame: passes and their render passes. graphs.txt has a block for each plan."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.planned import rows, scene_plan
from vkbloom import Separable, _core, presets

BLOCKS = Path(__file__).with_name("graphs.txt").read_text().strip().split("\n\n")


def shown(plan: _core.Plan) -> list[str]:
    """Return the lines of a block of graphs.txt."""
    lines = []
    for row in rows(plan):
        # A render pass is timed under the name of the first image that it writes.
        assert row.name == row.writes[0]
        reads = f"{', '.join(row.reads)} > " if row.reads else ""
        lines.append(f"{row.render_pass} {row.shader}: {reads}{', '.join(row.writes)}")
    assert {row.variant for row in rows(plan)} == {"fragment"}
    return lines


@pytest.mark.parametrize("block", BLOCKS, ids=[block.partition("\n")[0] for block in BLOCKS])
def test_the_graph_of_a_plan(block: str) -> None:
    head, *lines = block.splitlines()
    shading, text = head.removeprefix("# ").split(" ", 1)
    settings, _, sky = text.partition(" without ")
    given = eval(settings, {"Separable": Separable, "presets": presets})
    assert shown(scene_plan(given, has_sky=sky != "a sky", shading=shading)) == lines
