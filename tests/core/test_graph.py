"""The graph of a frame: its passes, their render passes, and the dependencies of these.

graphs.txt has a block for each plan: a line for each pass, and below the first pass of a render
pass how its subpass dependencies differ from the usual ones.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.planned import rows, scene_plan
from vkbloom import Separable, _core, presets

BLOCKS = Path(__file__).with_name("graphs.txt").read_text().strip().split("\n\n")

# VkPipelineStageFlagBits, VkAccessFlagBits and VkDependencyFlagBits of the Vulkan specification.
STAGES = {0x80: "fragment", 0x300: "depth tests", 0x400: "colour", 0x1000: "transfer"}
ACCESSES = {
    0x20: "read by shaders",
    0x100: "written",
    0x180: "blended",
    0x400: "depth written",
    0x600: "depth tested",
    0x800: "copied",
}
SIDES = {-1: "outside", 0: "inside"}
# Not by region: a blur reads neighbouring pixels, so it must wait for the complete image.
USUAL = [
    "outside fragment read by shaders -> inside colour written",
    "inside colour written -> outside fragment read by shaders",
]


def shown(plan: _core.Plan) -> list[str]:
    """Return the lines of a block of graphs.txt."""
    lines, seen = [], set()
    for row in rows(plan):
        # A render pass is timed under the name of the first image that it writes.
        assert row.name == row.writes[0]
        reads = f"{', '.join(row.reads)} > " if row.reads else ""
        lines.append(f"{row.render_pass} {row.shader}: {reads}{', '.join(row.writes)}")
        if row.render_pass not in seen:
            waits = []
            for begin, end, *bits, region in plan.dependencies[row.render_pass]:
                before, after = (
                    f"{SIDES[side]} {STAGES[stage]} {ACCESSES[access]}"
                    for side, stage, access in zip((begin, end), bits[:2], bits[2:], strict=True)
                )
                waits.append(f"{before} -> {after}" + ", by region" * region)
            lines += [f"    and {one}" for one in waits if one not in USUAL]
            lines += [f"    not {one}" for one in USUAL if one not in waits]
        seen.add(row.render_pass)
    assert {row.variant for row in rows(plan)} == {"fragment"}
    return lines


@pytest.mark.parametrize("block", BLOCKS, ids=[block.partition("\n")[0] for block in BLOCKS])
def test_the_graph_of_a_plan(block: str) -> None:
    head, *lines = block.splitlines()
    shading, text = head.removeprefix("# ").split(" ", 1)
    settings, _, sky = text.partition(" without ")
    given = eval(settings, {"Separable": Separable, "presets": presets})
    assert shown(scene_plan(given, has_sky=sky != "a sky", shading=shading)) == lines
