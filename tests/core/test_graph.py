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


def list_lines(plan: _core.Plan) -> list[str]:
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
    assert list_lines(scene_plan(given, has_sky=sky != "a sky", shading=shading)) == lines


def test_no_image_fills_a_slot_of_another_one() -> None:
    twice = {
        name
        for name, settings in presets.items()
        for row in rows(scene_plan(settings, (320, 180)))
        if len(set(row.reads)) < len(row.reads)
    }
    # Its ghosts are added to the image that they are of.
    assert twice == {"blender_ghosts"}


def test_slots_have_names() -> None:
    files = [*(ROOT / "csrc").rglob("*.c"), *(ROOT / "shaders").rglob("*.comp")]
    found = re.compile(r"\breads\[\d|read_shapes\[\d|READ_IMAGE\(\d")
    assert all(map(found.search, ("reads[1]", "read_shapes[0]", "READ_IMAGE(2)")))
    assert {"filter.c", "fft.comp"} <= {file.name for file in files}
    assert [file.name for file in files if found.search(file.read_text())] == []


# Adds a filter whose last kernel has one tap in the middle, or two at this distance.
FILTER = r"""
#include "passes/filter.h"

const char *add_filter(int distance)
{
    static struct vkb_error error;
    const struct vkb_image_row row = {.name = "level", .width = 8, .height = 8};
    const struct vkb_kernel kernels[][2] = {
        {vkb_sides(1.0, 0.5, 0.0), vkb_centre()},
        {vkb_sides(2.0, 0.5, 0.0), vkb_centre()},
        {vkb_sides(distance, distance ? 0.5 : 0.0, distance ? 0.0 : 1.0), vkb_centre()},
    };
    struct vkb_graph graph = {0};
    struct vkb_levels levels = {.graph = &graph, .error = &error};

    vkb_levels_add(&levels, &row);
    const struct vkb_filter filter = vkb_make_filter(&graph, 0, 0, kernels, 3, 1.0);
    vkb_add_filter_pass(&levels, &filter, 0, 0);
    vkb_graph_destroy(&graph);
    return levels.failed ? error.message : "added";
}
"""


# Passes: one reads the history of `bloom` and writes it, one makes `final` of it, and a fused one
# may replace both. Returns which are needed (n) and current (c), before and after a run, and after
# a call that continues this one; or why a history is refused.
HISTORIES = r"""
#include "graph/plan.h"

#include <stdio.h>

static struct vkb_error error;

static bool record(void *context, uint32_t first, uint32_t end, struct vkb_error *failure)
{
    (void)context, (void)first, (void)end, (void)failure;
    return true;
}

static void add_pass(struct vkb_graph *graph, uint32_t from, uint32_t to, bool fused)
{
    struct vkb_pass_row row = {.reads = {from}, .read_count = 1, .targets = {to}};

    row.depth = VKB_NO_IMAGE;
    row.target_count = 1;
    row.fused = fused;
    vkb_graph_add_pass(graph, &row, &error);
}

const char *keep(int kept)
{
    static char told[256];
    struct vkb_content contents[3] = {0};
    struct vkb_content *held[] = {&contents[0], &contents[1], &contents[2]};
    struct vkb_plan plan = {.outputs = (uint32_t[]){1}, .output_count = 1};
    struct vkb_plan_step step = {.plan = &plan, .contents = held};
    struct vkb_planner planner = {0};
    uint64_t clock = 100;
    uint32_t history = 0, again = 0;

    for (int i = 0; i < 2; ++i) {
        struct vkb_image_row row = {.format = VKB_FORMAT_RGBA8_UNORM, .width = 8, .height = 8};
        row.framebuffer = i != kept;
        snprintf(row.name, sizeof row.name, "%s", i ? "final" : "bloom");
        vkb_graph_add_image(&plan.graph, &row, NULL, &error);
    }
    if (!vkb_graph_add_history(&plan.graph, 0, &history, &error)
        || !vkb_graph_add_history(&plan.graph, 0, &again, &error))
        return error.message;
    add_pass(&plan.graph, history, 0, false);
    add_pass(&plan.graph, 0, 1, false);
    add_pass(&plan.graph, history, 1, true);
    size_t at = (size_t)snprintf(told, sizeof told, "%u %u", history, again);
    for (int i = 0; i < 3; ++i) {
        vkb_planner_mark(&planner, &step, &error);
        at += (size_t)snprintf(told + at, sizeof told - at, ", ");
        for (int pass = 0; pass < 3; ++pass)
            at += (size_t)snprintf(told + at, sizeof told - at, "%s%s ",
                                   planner.needed[pass] ? "n" : "",
                                   planner.current[pass] ? "c" : "");
        vkb_planner_run(&planner, &step, &clock, record, NULL, &error);
        contents[history].version = i ? contents[0].version : 0;
    }
    return told;
}
"""


def link(tree: Path, folder: Path, text: str) -> ctypes.CDLL:
    """Return a library of a text in C and of the core."""
    source, library = folder / "linked.c", folder / "linked.so"
    source.write_text(text)
    options = ("-DVK_NO_PROTOTYPES", "-Icsrc", "-I.", "-Ibuild/spirv", "-shared", "-fPIC")
    objects = map(str, (tree / "build").rglob("*.o"))
    command = [*compiler(), *options, str(source), *objects, "-o", str(library), "-lm", "-ldl"]
    subprocess.run(command, cwd=tree, check=True)
    return ctypes.CDLL(str(library))


def test_a_filter_with_too_many_places_fails(
    tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    add_filter = link(core_with_faults(tmp_path_factory.getbasetemp()), tmp_path, FILTER).add_filter
    add_filter.restype = ctypes.c_char_p
    assert add_filter(0) == add_filter(2) == b"added"
    assert add_filter(3) == b"filter: level has 6 places of taps along an axis, more than 5"


def test_what_has_a_history_is_made_in_each_call(
    tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    keep = link(core_with_faults(tmp_path_factory.getbasetemp()), tmp_path, HISTORIES).keep
    keep.restype = ctypes.c_char_p
    # Once it ran, all is up to date until the history has another content.
    assert keep(-1) == b"2 2, n n  , nc nc  , n n  "
    assert keep(0) == b"history: .bloom is no framebuffer"
