"""How the package is built: imports go one way, private names stay private, functions are short."""

from __future__ import annotations

import ast
import functools
import graphlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import vkbloom

PACKAGE = Path(vkbloom.__file__).parent
# The core is a module of its own, whose name says only that the package wraps it.
PUBLIC = {"_core"}
# The modules that read a renderer's core.
SEAM = {"vkbloom.renderer", "vkbloom.core_access"}


def module_files(package: Path) -> dict[str, Path]:
    """Return the files of a package by the names of their modules."""
    found = {}
    for file in (*package.rglob("*.py"), *package.rglob("*.pyi")):
        parts = file.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


@functools.cache
def nodes(text: str) -> list[ast.AST]:
    """Return all nodes of a module's tree, which several tests read."""
    return list(ast.walk(ast.parse(text)))


def from_imports(name: str, file: Path) -> Iterator[tuple[str, ast.alias]]:
    """Yield the module and the alias of each ``from`` import, also in functions and for types."""
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    for node in nodes(file.read_text(encoding="utf-8")):
        if isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level]
            base = ".".join([*(above if node.level else []), *filter(None, [node.module])])
            for alias in node.names:
                yield base, alias


def imported(name: str, file: Path, modules: dict[str, Path]) -> set[str]:
    """Return the package's modules that a module imports."""
    found = {
        f"{base}.{alias.name}" if f"{base}.{alias.name}" in modules else base
        for base, alias in from_imports(name, file)
    }
    for node in nodes(file.read_text(encoding="utf-8")):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
    return (found & modules.keys()) - {name}


def private_uses(name: str, file: Path) -> Iterator[str]:
    """Yield the private names of other modules that a module imports or reads."""
    root = name.partition(".")[0]
    modules = {root}
    for base, alias in from_imports(name, file):
        if base.partition(".")[0] != root:
            continue
        modules.add(alias.asname or alias.name)
        is_private = alias.name.startswith("_") and not alias.name.endswith("__")
        if is_private and alias.name not in PUBLIC:
            yield f"{name}: from {base} import {alias.name}"
    for node in nodes(file.read_text(encoding="utf-8")):
        if isinstance(node, ast.Attribute) and node.attr.startswith("_"):
            owner = ast.unparse(node.value)
            is_public = node.attr.endswith("__") or node.attr in PUBLIC
            if not is_public and (owner in modules or owner.startswith(f"{root}.")):
                yield f"{name}: {owner}.{node.attr}"


def circle(package: Path) -> list[str]:
    """Return the modules of one circle of imports, none where there is no circle."""
    modules = module_files(package)
    graph = {name: imported(name, file, modules) for name, file in modules.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def test_no_circle() -> None:
    assert circle(PACKAGE) == []


def test_no_module_uses_private_names_of_another() -> None:
    files = module_files(PACKAGE)
    assert len(files) > 100
    assert [use for name, file in files.items() for use in private_uses(name, file)] == []


def test_core_of_a_renderer_is_read_in_the_seam_only() -> None:
    reading = {
        name
        for name, file in module_files(PACKAGE).items()
        for node in nodes(file.read_text(encoding="utf-8"))
        if isinstance(node, ast.Attribute)
        and node.attr == "_core"
        and ast.unparse(node.value) not in ("self", "vkbloom")
    }
    assert reading <= SEAM


@pytest.mark.parametrize(
    "text",
    [
        "from package import first\n",
        "from . import first\n",
        "from .first import name\n",
        "import package.first\n",
        "def function():\n    from package.first import name\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from package.first import name\n",
    ],
)
def test_circles_are_found(text: str, tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "first.py").write_text("from package.second import name\n")
    (package / "second.py").write_text("")
    assert circle(package) == []
    (package / "second.py").write_text(text)
    assert set(circle(package)) == {"package.first", "package.second"}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("from package.first import _name\n", ["package.second: from package.first import _name"]),
        ("from .first import _name\n", ["package.second: from package.first import _name"]),
        ("from package import first\nfirst._name\n", ["package.second: first._name"]),
        ("import package.first\npackage.first._name\n", ["package.second: package.first._name"]),
        ("from package import _core, first\n_core.x\nfirst.__doc__\nimport os\nos._exit\n", []),
    ],
)
def test_private_uses_are_found(text: str, found: list[str], tmp_path: Path) -> None:
    file = tmp_path / "second.py"
    file.write_text(text)
    assert list(private_uses("package.second", file)) == found


def code_lines(function: ast.FunctionDef | ast.AsyncFunctionDef, lines: list[str]) -> int:
    """Return the lines of a function without blank lines, comments and its docstring."""
    first, begin = function.body[0], function.lineno - 1
    head_end = first.lineno - 1
    documented = (first.end_lineno or 0) if ast.get_docstring(function) is not None else head_end
    kept = [*lines[begin:head_end], *lines[documented : function.end_lineno]]
    return sum(bool(line.strip()) and not line.lstrip().startswith("#") for line in kept)


def test_functions_have_at_most_60_lines_of_code() -> None:
    long = []
    for name, file in module_files(PACKAGE).items():
        text = file.read_text(encoding="utf-8")
        for node in nodes(text):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                count = code_lines(node, text.splitlines())
                long += [f"{name}.{node.name}: {count} lines"] if count > 60 else []
    assert not long
