"""How much tests say of the inside of the package: what users see may stay as modules move."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parents[1]
#: The most imports from private modules in files of tests. What several files need of one module is
#: imported once: by `tests.planned` (the core), `tests.kinds`, `tests.scene.parts` or
#: `tests.explorer.pages`. Whoever raises a limit says why no public name, file or command tells it.
MAX_IMPORTS = 130
#: The most attributes that all tests replace, of the package and of other libraries. A real fault
#: (a full disk, a missing program, a killed process) also finds what a replaced function hides.
#: Two are of compilers that are installed and must be missing, and of which passes of derivatives
#: run, which no result tells.
MAX_PATCHES = 87


def private_imports(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "vkbloom":
            names = (*str(node.module).split("."), *(name.name for name in node.names))
            if any(name.startswith("_") and not name.endswith("__") for name in names):
                yield ast.unparse(node)


def patches(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in ("setattr", "delattr"):
            yield ast.unparse(node)


def test_what_is_counted() -> None:
    text = (
        "from vkbloom import Pyramid, _core\n"
        "from vkbloom._io.picture import Picture\n"
        "from vkbloom.testing import _probe as probe\n"
        "from vkbloom import Scene, __version__\n"
        "def test(monkeypatch):\n    monkeypatch.setattr(probe, 'size', 3)\n"
    )
    tree = ast.parse(text)
    assert [*private_imports(tree)] == text.splitlines()[:3]
    assert [*patches(tree)] == ["monkeypatch.setattr"]


def test_tests_know_little_of_the_inside() -> None:
    trees = {file: ast.parse(file.read_text("utf-8")) for file in TESTS.rglob("*.py")}
    imports = [
        f"{file.name}: {text}"
        for file, tree in trees.items()
        for text in private_imports(tree)
        if file.name.startswith("test_")
    ]
    assert len(imports) <= MAX_IMPORTS, "\n".join(imports)
    replaced = [f"{file.name}: {text}" for file, tree in trees.items() for text in patches(tree)]
    assert len(replaced) <= MAX_PATCHES, "\n".join(replaced)
