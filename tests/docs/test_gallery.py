"""The gallery of examples: they run, and with the docstrings they show every public name."""

from __future__ import annotations

import ast
import inspect
import re
import runpy
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import vkbloom
from tests.docs.pages import ROOT
from tests.exhaustive import some

GALLERY = ROOT / "examples" / "gallery"
EXAMPLES = sorted(GALLERY.glob("*/*.py"))


def name_of(path: Path) -> str:
    return path.stem


# make docs runs all of them.
@pytest.mark.parametrize("path", some(EXAMPLES, 6), ids=name_of)
def test_an_example_runs(
    path: Path, tmp_path: Path, kept_renderers: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As written, in an empty folder."""
    for module in modules_of(path):
        pytest.importorskip(module)
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VKBLOOM_ADAPTER", "software")
    runpy.run_path(str(path))
    assert pyplot.get_fignums()
    pyplot.close("all")


@pytest.mark.parametrize("path", EXAMPLES, ids=name_of)
def test_an_example_is_short_and_says_what_it_shows(path: Path) -> None:
    tree = ast.parse(path.read_text())
    text = ast.get_docstring(tree) or ""
    title, line, empty, *words = text.splitlines()
    assert line == "=" * len(title)
    assert not empty
    assert words
    assert not title.endswith(".")
    lines = path.read_text().splitlines()[tree.body[0].end_lineno or 0 :]
    assert 10 <= len([one for one in lines if one.strip()]) <= 40
    assert lines[-1] == "plt.show()"


def test_each_folder_is_a_section() -> None:
    for folder in {path.parent for path in EXAMPLES} | {GALLERY}:
        assert (folder / "GALLERY_HEADER.rst").exists(), folder
    assert len(EXAMPLES) >= 30
    assert len({path.stem for path in EXAMPLES}) == len(EXAMPLES)


def imports_of(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield each name that a program imports, and what it stands for."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for one in node.names:
                yield one.asname or one.name, one.name
        elif isinstance(node, ast.ImportFrom):
            for one in node.names:
                yield one.asname or one.name, f"{node.module}.{one.name}"


def modules_of(path: Path) -> set[str]:
    return {full.partition(".")[0] for _, full in imports_of(ast.parse(path.read_text()))}


@cache
def names_in(text: str) -> frozenset[str]:
    """Return the complete dotted names that a program uses of what it imports."""
    tree = ast.parse(text)
    imported = dict(imports_of(tree)) or {"vkbloom": "vkbloom", "np": "numpy"}
    found = set()
    for node in ast.walk(tree):
        parts: list[str] = []
        inner: ast.AST = node
        while isinstance(inner, ast.Attribute):
            parts.insert(0, inner.attr)
            inner = inner.value
        if isinstance(inner, ast.Name) and inner.id in imported:
            found.add(".".join([imported[inner.id], *parts]))
    return frozenset(found)


def used_in_examples() -> set[str]:
    """Return the names that the gallery uses, with those of classes that stand before a method."""
    used = {name for path in EXAMPLES for name in names_in(path.read_text())}
    return used | {name.rpartition(".")[0] for name in used}


MODULES = ("vkbloom", "vkbloom.psf", "vkbloom.reference", "vkbloom.testing", "vkbloom.torch")


def public_names() -> Iterator[tuple[str, Any]]:
    """Yield the public functions and classes that a user can call; errors are raised."""
    for module in MODULES:
        if module.endswith("torch"):
            names: dict[str, Any] = {}
            tree = ast.parse((ROOT / "python" / "vkbloom" / "torch.py").read_text())
            for node in tree.body:
                if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name[0] != "_":
                    names[node.name] = ast.get_docstring(node)
        else:
            owner = vkbloom if module == "vkbloom" else getattr(vkbloom, module.split(".")[1])
            names = {name: getattr(owner, name) for name in owner.__all__}
        for name, thing in names.items():
            if isinstance(thing, ModuleType) or (
                isinstance(thing, type) and issubclass(thing, BaseException)
            ):
                continue
            if callable(thing) or isinstance(thing, str):
                yield f"{module}.{name}", thing


def docstring_of(thing: Any) -> str:
    return thing if isinstance(thing, str) else inspect.getdoc(thing) or ""


def classes_named_by(thing: Any) -> set[str]:
    """Return the names of classes that a function or method returns, or attributes are of."""
    own = getattr(thing, "__annotations__", {})
    kinds = [own.get("return")]
    if isinstance(thing, type):
        members = [one for name, one in vars(thing).items() if not name.startswith("_")]
        kinds = [
            *own.values(),
            *(getattr(one, "__annotations__", {}).get("return") for one in members),
        ]
    return {word for kind in kinds for word in re.findall(r"\w+", str(kind))}


def test_every_public_function_has_an_example() -> None:
    """In the gallery or its docstring. A class also counts if what has one returns it."""
    every = dict(public_names())
    used = used_in_examples()
    shown = {name for name, thing in every.items() if name in used or ">>>" in docstring_of(thing)}
    while True:
        results = {word for name in shown for word in classes_named_by(every[name])}
        # A base class counts with a class that derives from it.
        bases = {
            base.__name__
            for name in shown
            if isinstance(every[name], type)
            for base in every[name].__mro__
        }
        further = {
            name
            for name, thing in every.items()
            if isinstance(thing, type) and thing.__name__ in results | bases
        }
        if further <= shown:
            break
        shown |= further
    assert sorted(set(every) - shown) == []


@pytest.mark.parametrize("module", ["numpy", "xarray", "torch", "scipy", "skimage"])
def test_docstrings_name_what_other_projects_have(module: str) -> None:
    """A page of another project is stored for each of its objects that docstrings name."""
    listed = tomllib.loads((ROOT / "docs" / "other_projects.toml").read_text())[module]
    stored = {
        entry
        for roles in listed["pages"].values()
        for entries in roles.values()
        for entry in entries
    }
    texts = [path.read_text() for path in (ROOT / "python" / "vkbloom").rglob("*.py")]
    named = {one for text in texts for one in re.findall(rf"`({module}(?:\.\w+)+)`", text)}
    named -= {"torch.ops.vkbloom.bloom"}  # the project's own
    assert named <= stored


def test_the_pages_of_other_projects(tmp_path: Path) -> None:
    """As Sphinx reads them: the inventories need no network, and name complete addresses."""
    inventory = pytest.importorskip("sphinx.util.inventory").InventoryFile
    links = runpy.run_path(str(ROOT / "docs" / "links.py"))
    pages = set()
    for name, (url, (file,)) in links["write_inventories"](tmp_path).items():
        assert Path(file).name == f"{name}.inv"
        found = inventory.loads(Path(file).read_bytes(), uri=url).data
        pages |= {item.uri for items in found.values() for item in items.values()}
    assert not [page for page in pages if "$" in page or not page.startswith("https://")]
    numpy = "https://numpy.org/doc/stable/reference/generated"
    assert f"{numpy}/numpy.ndarray.html#numpy.ndarray" in pages
    assert "https://docs.xarray.dev/en/stable/generated/xarray.Dataset.html#xarray.Dataset" in pages
    assert "https://docs.pytorch.org/docs/stable/tensors.html#torch.Tensor" in pages


def test_every_doi_is_on_the_page_of_literature() -> None:
    page = (ROOT / "docs" / "literature.md").read_text()
    texts = [path.read_text() for path in (ROOT / "python" / "vkbloom").rglob("*.py")]
    found = {one.rstrip(".") for text in texts for one in re.findall(r"doi\.org/([\w./-]+)", text)}
    assert len(found) >= 8
    assert {doi for doi in found if f"[{doi}](https://doi.org/{doi})" not in page} == set()


def test_links_lead_to_the_source() -> None:
    """Of each public name, to the lines that define it."""
    links = runpy.run_path(str(ROOT / "docs" / "links.py"))
    names = [name for name, thing in public_names() if not isinstance(thing, str)]
    for name in [*names, "vkbloom.Renderer.apply", "vkbloom.Frames.timings"]:
        module = max((one for one in MODULES if name.startswith(f"{one}.")), key=len)
        page = links["source_page"]("https://example.org/x", module, name[len(module) + 1 :])
        ((path, first, last),) = re.findall(
            r"^https://example\.org/x/blob/\w+/(.*)#L(\d+)-L(\d+)$", page
        )
        lines = (ROOT / path).read_text().splitlines()[int(first) - 1 : int(last)]
        kinds = rf"^ *(?:class|def) {name.rpartition('.')[2]}\b"
        assert any(re.match(kinds, line) for line in lines[:12]), name
