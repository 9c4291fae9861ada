"""The C core's folders include each other in one direction; functions are short."""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path

CORE = Path(__file__).parents[2] / "csrc"
SHADERS = CORE.parent / "shaders"
#: Folders of one layer include each other; the files within do so without a circle.
LAYERS = (
    ("vulkan",),
    ("graph",),
    ("spirv",),
    ("scene",),
    ("passes",),
    ("methods",),
    ("variants",),
    ("share", "transfer", "execute"),
    ("python",),
)
ORDER = {folder: layer for layer, folders in enumerate(LAYERS) for folder in folders}


def test_folders_include_those_before_them() -> None:
    files = [*CORE.glob("*/*.c"), *CORE.glob("*/*.h")]
    assert {file.parent.name for file in files} == set(ORDER)
    for file in files:
        own = ORDER[file.parent.name]
        for folder in re.findall(r'#include "(\w+)/', file.read_text(encoding="utf-8")):
            if folder != "shaders":
                assert ORDER[folder] <= own, (file.relative_to(CORE), folder)


def test_headers_do_not_include_each_other_in_a_circle() -> None:
    found = {str(file.relative_to(CORE)): file.read_text("utf-8") for file in CORE.glob("*/*.h")}
    order_of({name: set(re.findall(r'#include "(.+)"', text)) for name, text in found.items()})


def test_files_do_not_use_each_other_in_a_circle() -> None:
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
    order_of(
        {
            file: {owners.get(name, file) for name in re.findall(r"(?<!struct )\bvkb_\w+", text)}
            - {file}
            for file, text in texts.items()
        }
    )


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
