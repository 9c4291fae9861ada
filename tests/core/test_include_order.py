"""The C core's folders include each other in one direction."""

from __future__ import annotations

import re
from pathlib import Path

CORE = Path(__file__).parents[2] / "csrc"
ORDER = ("vulkan", "graph", "scene", "passes", "methods", "variants", "run", "python")


def test_folders_include_those_before_them() -> None:
    files = [*CORE.glob("*/*.c"), *CORE.glob("*/*.h")]
    assert {file.parent.name for file in files} == set(ORDER)
    for file in files:
        own = ORDER.index(file.parent.name)
        for folder in re.findall(r'#include "(\w+)/', file.read_text(encoding="utf-8")):
            if folder != "shaders":
                assert ORDER.index(folder) <= own, (file.relative_to(CORE), folder)
