"""Links from the pages of the API to those of other projects, and to the source."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import subprocess
import sys
import tomllib
import zlib
from pathlib import Path
from types import FunctionType
from typing import Any, Final, NamedTuple

from vkbloom._public import defining_module

_HERE: Final = Path(__file__).parent
ROOT: Final = _HERE.parent


def write_inventories(folder: Path) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Write an inventory of each project in ``other_projects.toml``, as Sphinx publishes them.

    So links need no network when the pages are built. Returns ``intersphinx_mapping``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    mapping = {}
    for name, project in tomllib.loads((_HERE / "other_projects.toml").read_text()).items():
        lines = [
            f"{entry} {role} 1 {page.replace('$', entry)} -\n"
            for page, roles in project["pages"].items()
            for role, entries in roles.items()
            for entry in entries
        ]
        head = f"# Sphinx inventory version 2\n# Project: {name}\n# Version: \n"
        head += "# The remainder of this file is compressed using zlib.\n"
        file = folder / f"{name}.inv"
        file.write_bytes(head.encode() + zlib.compress("".join(lines).encode()))
        mapping[name] = (project["url"], (str(file),))
    return mapping


def aliases() -> dict[str, str]:
    """Return what the words are that stand for types in docstrings, beside numpydoc's own."""
    words = {
        "Dataset": "xarray.Dataset",
        "DataArray": "xarray.DataArray",
        "Tensor": "torch.Tensor",
        "mapping": ":term:`python:mapping`",
        "path-like": ":term:`path-like <python:path-like object>`",
    }
    for module in ("vkbloom", "vkbloom.psf", "vkbloom.reference", "vkbloom.testing"):
        for name in importlib.import_module(module).__all__:
            # (Functions have names that are words, too.)
            if name[0].isupper():
                words.setdefault(name, f"{module}.{name}")
    return words


class Lines(NamedTuple):
    """Where the source of something is: a file, its first line and its last."""

    file: Path
    first: int
    last: int


@functools.cache
def _classes(file: Path) -> dict[str, ast.ClassDef]:
    """Return the classes of a file by name."""
    return {
        node.name: node
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.ClassDef)
    }


def _thing(module: str, name: str) -> Any:
    """Return what has a name in a module, such as a method as its class has it."""
    thing: Any = importlib.import_module(module)
    for part in name.split("."):
        is_module = inspect.ismodule(thing)
        thing = getattr(thing, part) if is_module else inspect.getattr_static(thing, part)
    return thing


def module_of(module: str, name: str) -> str:
    """Return the module that has the source of a public name."""
    try:
        return defining_module(_thing(module, name.partition(".")[0]))
    except ImportError:  # PyTorch is not installed
        return module


def lines_of(module: str, name: str) -> Lines | None:
    """Return where a public name, such as "Renderer.apply" of "vkbloom", is defined.

    None: it has no source in Python, such as a mapping or a field, or needs a package that is not
    installed.
    """
    try:
        thing = _thing(module, name)
    except (ImportError, AttributeError):
        return None
    if isinstance(thing, type):
        file = Path(str(sys.modules[defining_module(thing)].__file__))
        found = _classes(file).get(thing.__name__)
        return found and Lines(file, found.lineno, found.end_lineno or found.lineno)
    thing = getattr(thing, "fget", None) or getattr(thing, "func", None) or thing
    thing = inspect.unwrap(getattr(thing, "__func__", thing))
    if not isinstance(thing, FunctionType):
        return None
    source, first = inspect.getsourcelines(thing)
    return Lines(Path(thing.__code__.co_filename), first, first + len(source) - 1)


@functools.cache
def _revision() -> str:
    """Return the commit, or the tag of this version where there is no checkout."""
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    return done.stdout.strip() or f"v{version}"


def repository() -> str | None:
    """Return the address of the repository that ``pyproject.toml`` names; None: it names none."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    urls = {name.lower(): url for name, url in project.get("urls", {}).items()}
    found = next((urls[name] for name in ("source", "repository") if name in urls), None)
    return found and found.rstrip("/").removesuffix(".git")


def source_page(base: str, module: str, name: str) -> str | None:
    """Return the page of the lines that define a name, in a repository at an address."""
    found = lines_of(module, name)
    if found is None or not found.file.is_relative_to(ROOT):
        return None
    path = found.file.relative_to(ROOT).as_posix()
    return f"{base}/blob/{_revision()}/{path}#L{found.first}-L{found.last}"
