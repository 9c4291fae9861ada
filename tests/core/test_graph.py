"""The graph of a frame: passes and their render passes. graphs.txt has a block for each plan."""

from __future__ import annotations

import ctypes
import re
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT, compiler, core_with_faults
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


def test_no_image_fills_a_slot_of_another_one() -> None:
    twice = {
        name
        for name, settings in presets.items()
        for row in rows(scene_plan(settings))
        if len(set(row.reads)) < len(row.reads)
    }
    # Its ghosts are added to the image that they are of.
    assert twice == {"blender_ghosts"}


def test_slots_have_names() -> None:
    files = [*(ROOT / "csrc").rglob("*.c"), *(ROOT / "shaders").rglob("*.comp")]
    found = re.compile(r"\breads\[\d|read_shapes\[\d|READ_IMAGE\(\d")
    assert [file.name for file in files if found.search(file.read_text())] == []


# Adds a filter whose last kernel has one tap in the middle, or two at this distance.
FILTER = r"""
#include "passes/filter.h"

const char *add_filter(int distance)
{
    static struct vkb_error error;
    const struct vkb_image_row row = {.name = "level", .width = 8, .height = 8};
    const struct vkb_side_taps one = {0.0, 0.0, 1.0}, two = {1.0, 0.5, 0.0}, four = {2.0, 0.5, 0.0};
    const struct vkb_side_taps last = {distance, distance ? 0.5 : 0.0, distance ? 0.0 : 1.0};
    const struct vkb_taps filter = {{{two, one}, {four, one}, {last, one}}, .gain = 1.0};
    struct vkb_graph graph = {0};
    struct vkb_levels levels = {.graph = &graph, .error = &error};

    vkb_levels_add(&levels, &row);
    vkb_add_filter(&levels, &filter, 0, 0);
    vkb_graph_destroy(&graph);
    return levels.failed ? error.message : "added";
}
"""


def test_a_filter_with_too_many_places_fails(
    tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    tree = core_with_faults(tmp_path_factory.getbasetemp())
    source, library = tmp_path / "filter.c", tmp_path / "filter.so"
    source.write_text(FILTER)
    options = ("-DVK_NO_PROTOTYPES", "-Icsrc", "-I.", "-Ibuild/spirv", "-shared", "-fPIC")
    objects = map(str, (tree / "build").rglob("*.o"))
    command = [*compiler(), *options, str(source), *objects, "-o", str(library), "-lm", "-ldl"]
    subprocess.run(command, cwd=tree, check=True)
    add_filter = ctypes.CDLL(str(library)).add_filter
    add_filter.restype = ctypes.c_char_p
    assert add_filter(0) == add_filter(2) == b"added"
    assert add_filter(3) == b"filter: level has 6 x 1 places of taps, more than 5"
