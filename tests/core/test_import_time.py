"""The modules that ``import vkbloom`` loads: none, so that the command line can answer Ctrl-C; the
first use of a renderer loads only those that a program needs to render one frame."""

from __future__ import annotations

import pkgutil
from importlib.util import find_spec

import pytest

import vkbloom
from tests.processes import output

#: The packages that a program needs to render one frame. Every other one is loaded later.
NEEDED = {
    "_antialiasing",
    "_exposure",
    "_glare",
    "_methods",
    "_presets",
    "_psf",
    "_renderer",
    "_settings",
}
#: Packages of which it needs these modules alone.
FEW = {
    "_antialiasing": set(),
    "_exposure": set(),
    "_glare": set(),
    "_methods": {"mip_chain"},
    "_presets": set(),
    "_psf": set(),
}
# NumPy loads some of the standard library itself, differently by version.
LATE = {
    "vkbloom._renderer.plans",
    "hashlib",
    "html",
    "importlib.metadata",
    "json",
    "pathlib",
    "shutil",
    "tempfile",
}


def load(code: str) -> set[str]:
    code += "; import sys; print(*sys.modules)"
    return set(output("-c", code).split())


def test_the_import_loads_what_is_needed() -> None:
    late = {"numpy", "click", "rich", "tqdm", "OpenImageIO"}
    assert not late & load("import vkbloom._cli")
    code = "import vkbloom; vkbloom.Renderer, vkbloom.Pyramid"
    added = load(code) - load("import numpy, numpy.typing, dataclasses")
    names = [name.split(".")[1:] for name in added if name.startswith("vkbloom.")]
    packages = {module.name for module in pkgutil.iter_modules(vkbloom.__path__) if module.ispkg}
    assert packages & {parts[0] for parts in names} == NEEDED
    for package, modules in FEW.items():
        assert {parts[1] for parts in names if parts[0] == package and parts[1:]} == modules
    # A module that is gone would never be loaded.
    assert [name for name in LATE if find_spec(name) is None] == []
    assert sorted(added & LATE) == []


@pytest.mark.parametrize("name", [*vkbloom.__all__, "__version__"])
def test_every_public_name_is_there_after_the_import(name: str) -> None:
    found = getattr(vkbloom, name)
    assert getattr(found, "__name__", name).rpartition(".")[2] == name


def test_late_modules_are_there_at_the_first_use() -> None:
    code = "import vkbloom; vkbloom.reference.apply; vkbloom.Scene; vkbloom.testing.stability"
    assert "vkbloom.testing._moving_light" in load(code)
