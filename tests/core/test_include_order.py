"""The C core's folders include each other in one direction; functions are short."""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

CORE = Path(__file__).parents[2] / "csrc"
SHADERS = CORE.parent / "shaders"
FILES = sorted([*CORE.glob("*/*.c"), *CORE.glob("*/*.h")])
#: Headers that setup.py makes, and that C shares with GLSL.
OTHERS = ("spirv.h", "shaders/params.h")


def read_map(text: str) -> dict[str, set[str]]:
    """Return for each folder of the drawing of csrc/README.md the folders that it may include.

    A line with two columns has a folder of each half; the other lines are the ground of both.
    """
    (drawing,) = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    lines = drawing.splitlines()
    margin = min(len(line) - len(line.lstrip()) for line in lines)
    allowed: dict[str, set[str]] = {}
    ground: set[str] = set()
    halves: tuple[set[str], set[str]] = (set(), set())
    for line in lines:
        if line[margin] == " ":
            ground |= halves[0] | halves[1] | {line.strip()}
            allowed[line.strip()] = set(ground)
            continue
        columns = re.split(r" {4,}", line.strip())
        for half, column in zip(halves, columns, strict=True):
            rooms = [set(room.split()) for room in column.split("|")]
            for room in rooms:
                allowed |= dict.fromkeys(room, ground | half | room)
            half.update(*rooms)
    return allowed


ALLOWED = read_map((CORE / "README.md").read_text("utf-8"))


def find_refused_includes(folder: str, text: str, allowed: dict[str, set[str]]) -> list[str]:
    """Return the headers that a file of the folder includes and must not."""
    found = re.findall(r'^\s*#\s*include\s*(["<])([^">]+)', text, re.MULTILINE)
    return [
        name
        for quote, name in found
        # A header of the core in angle brackets is found, too.
        if (quote == '"' or (CORE / name).exists())
        and name not in OTHERS
        and (name.count("/") != 1 or name.split("/")[0] not in allowed[folder])
    ]


def test_folders_include_what_the_map_allows() -> None:
    assert {file.parent.name for file in FILES} == set(ALLOWED)
    for file in FILES:
        text = file.read_text("utf-8")
        assert find_refused_includes(file.parent.name, text, ALLOWED) == [], file.relative_to(CORE)


@pytest.mark.parametrize(
    ("folder", "include"),
    [
        # What runs rows does not know how they are made, and the other way round.
        ("execute", '"methods/methods.h"'),
        ("execute", '"passes/settings.h"'),
        ("transfer", '"variants/variants.h"'),
        ("share", '"passes/pass.h"'),
        ("spirv", '"passes/pass.h"'),
        ("passes", '"scene/scene.h"'),
        ("methods", '"execute/record.h"'),
        ("variants", '"spirv/specialize.h"'),
        # Neighbours.
        ("methods", '"variants/variant.h"'),
        ("variants", '"methods/methods.h"'),
        ("scene", '"spirv/module.h"'),
        # What is below.
        ("vulkan", '"graph/graph.h"'),
        ("graph", '"spirv/module.h"'),
        ("passes", '"methods/methods.h"'),
        ("share", '"python/objects.h"'),
        # Other ways to write it.
        ("execute", '"../methods/methods.h"'),
        ("execute", "<methods/methods.h>"),
        ("execute", '"methods.h"'),
    ],
)
def test_planted_includes_are_refused(folder: str, include: str) -> None:
    text = f'#include "vulkan/error.h"\n#include "spirv.h"\n # include {include}\n'
    assert find_refused_includes(folder, text, ALLOWED) == [include[1:-1]]


def test_a_bar_separates_folders_of_a_line() -> None:
    drawing = "```text\n      low\n  a | b    c d\n      high\n```"
    assert read_map(drawing) == {
        "low": {"low"},
        "a": {"low", "a"},
        "b": {"low", "b"},
        "c": {"low", "c", "d"},
        "d": {"low", "c", "d"},
        "high": {"low", "a", "b", "c", "d", "high"},
    }


@pytest.mark.parametrize(
    ("pattern", "planted", "reason"),
    [
        (
            r"\bVKB_METHOD_(?!COUNT|ENUM|FUNCTION)[A-Z_]+\b",
            "VKB_METHOD_KINO",
            "a member of the method's row says it",
        ),
        (
            r"\bPyImport_\w+",
            "PyImport_ImportModule",
            "the package gives the core what it needs (connect)",
        ),
    ],
)
def test_no_file_names(pattern: str, planted: str, reason: str) -> None:
    assert re.findall(pattern, f"if ({planted}(one))") == [planted]
    found = {file.name: re.findall(pattern, file.read_text("utf-8")) for file in FILES}
    assert {name: names for name, names in found.items() if names} == {}, reason


def test_headers_do_not_include_each_other_in_a_circle() -> None:
    found = {str(file.relative_to(CORE)): file.read_text("utf-8") for file in CORE.glob("*/*.h")}
    order = order_of(
        {name: set(re.findall(r'#include "(.+)"', text)) for name, text in found.items()}
    )
    assert order.index("vulkan/error.h") < order.index("vulkan/memory.h")


def test_files_use_what_the_map_allows_and_not_in_a_circle() -> None:
    """By the names that a file defines for others. (faults.c is part of test builds only.)"""
    texts = {
        str(file.relative_to(CORE)): re.sub(
            r'//.*|"(?:\\.|[^"\\\n])*"', "", file.read_text("utf-8")
        )
        for file in CORE.glob("*/*.c")
        if file.name != "faults.c"
    }
    owners = {
        name: file
        for file, text in texts.items()
        for name in re.findall(
            r"^(?!static|extern|#)[A-Za-z_][\w *]*?\b(vkb_\w+)(?:\(|\s*=|\[)", text, re.MULTILINE
        )
    }
    assert owners["vkb_raise"] == "python/objects.c"
    used = {
        file: {owners.get(name, file) for name in re.findall(r"(?<!struct )\bvkb_\w+", text)}
        - {file}
        for file, text in texts.items()
    }
    for file, others in used.items():
        allowed = ALLOWED[Path(file).parent.name]
        assert [other for other in others if Path(other).parent.name not in allowed] == [], file
    order_of(used)


def test_functions_have_at_most_60_lines_of_code() -> None:
    longest = {}
    for file in [*CORE.glob("*/*.[ch]"), *SHADERS.glob("*/*.*")]:
        text = re.sub(r"//.*|/\*(?s:.*?)\*/", "", file.read_text("utf-8"))
        functions = re.findall(r"^\w[^{};]*\n\{\n(?s:.*?)^\}$", text, re.MULTILINE)
        lines = (sum(bool(line.strip()) for line in one.split("\n")) for one in functions)
        longest[file.name] = max(lines, default=0)
    assert longest["record.c"] > 20
    assert {name: lines for name, lines in longest.items() if lines > 60} == {}


def order_of(users: dict[str, set[str]]) -> list[str]:
    """Raises CycleError where there is no order."""
    return list(TopologicalSorter(users).static_order())


#: The files that may tell a set of taps, a combination or a point function by its name; all others
#: expand the tables, or name a row of PREFILTERS.
CHOOSERS = 8


def test_few_files_name_the_choices_of_prefilters() -> None:
    table = (SHADERS / "params.h").read_text("utf-8")
    rows = re.findall(r"^    PREFILTER\((\w+), (\w+), (\w+), (\w+), (\w+)\)", table, re.MULTILINE)
    names = set(
        re.findall(
            r"^    (?:SET|LINE|AVERAGE|SUM|WITHIN|SELECT|POINT)\((\w+), \d", table, re.MULTILINE
        )
    )
    names.add("POINT_NONE")
    assert names == {name for _, *choice in rows for name in choice}
    texts = {
        file: re.sub(r"//.*", "", file.read_text("utf-8"))
        for folder in (CORE, SHADERS)
        for file in folder.glob("*/*.*")
    }
    word = re.compile(rf"\b(?:{'|'.join(names)})\b")
    choosers = [file.name for file, text in texts.items() if word.search(text)]
    assert len(choosers) < CHOOSERS, choosers
    methods = "".join(text for file, text in texts.items() if file.parent.name == "methods")
    assert {name for name, *_ in rows} == set(re.findall(r"\bVKB_PREFILTER_(\w+)", methods))
