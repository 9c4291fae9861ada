"""``make lint`` refuses each way to import a module of a higher floor, in a copy of the package."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final, NamedTuple

import pytest

from tests.docs.pages import ROOT

PACKAGE: Final = ROOT / "python" / "vkbloom"


class Planted(NamedTuple):
    """A statement at the end of a module, and what is said of it, and by which tool."""

    module: str
    code: str
    tool: str
    said: str


PLANTED: Final = {
    "a statement": Planted(
        "_io.picture",
        "from vkbloom._renderer.frames import Frames",
        "floors",
        "vkbloom._io.picture -> vkbloom._renderer.frames",
    ),
    "in a function": Planted(
        "_settings.fields",
        "def planted():\n    from vkbloom._methods.three import ThreeBloom",
        "floors",
        "vkbloom._settings.fields -> vkbloom._methods.three",
    ),
    "for type checkers": Planted(
        "reference._image",
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from vkbloom._renderer.plans import Plan",
        "floors",
        "vkbloom.reference._image -> vkbloom._renderer.plans",
    ),
    "between rooms of a floor": Planted(
        "_glare.dirt",
        "from vkbloom._methods.three import ThreeBloom",
        "floors",
        "vkbloom._glare.dirt -> vkbloom._methods.three",
    ),
    "in a circle": Planted(
        "_renderer.sources",
        "from vkbloom._renderer import state",
        "no circles",
        "No cycles are allowed in vkbloom._renderer",
    ),
    "by the package": Planted(
        "_views.markup",
        "def planted():\n    import vkbloom\n\n    return vkbloom.Renderer",
        "no imports of vkbloom",
        "vkbloom._views.markup, line",
    ),
    "by a module of the package": Planted(
        "_views.shifts",
        "import vkbloom._locks\n\nplanted = vkbloom.Renderer",
        "no imports of vkbloom",
        "vkbloom._views.shifts, line",
    ),
    "by a string": Planted(
        "_scene.mesh",
        'import importlib\n\nplanted = importlib.import_module("vkbloom._renderer.frames")',
        "TID251",
        "_scene/mesh.py",
    ),
}


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What each tool says of a copy of the package with all of `PLANTED`."""
    pytest.importorskip("importlinter", reason="import-linter is not installed; run make lint")
    folder = tmp_path_factory.mktemp("planted")
    shutil.copy(ROOT / "pyproject.toml", folder)
    (folder / "tools").mkdir()
    shutil.copy(ROOT / "tools" / "import_contracts.py", folder / "tools")
    for source in PACKAGE.rglob("*.py"):
        copied = folder / "python" / "vkbloom" / source.relative_to(PACKAGE)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copied)
    for module, code, *_ in PLANTED.values():
        file = folder / "python" / "vkbloom" / f"{module.replace('.', '/')}.py"
        file.write_text(f"{file.read_text()}\n\n{code}\n")
    linted = failing(folder, "lint-imports", "--no-cache", "--no-logo")
    parts = re.split(r"^(floors|no circles|no imports of vkbloom)\n-+\n", linted, flags=re.M)
    strings = failing(folder, "ruff", "check", "--no-cache", "--select", "TID251", "python")
    return {**dict(zip(parts[1::2], parts[2::2], strict=True)), "TID251": strings}


def failing(folder: Path, program: str, *arguments: str) -> str:
    """What a program of this environment prints, which must fail."""
    done = subprocess.run(
        [Path(sys.executable).with_name(program), *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "python")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("way", PLANTED)
def test_an_import_of_a_higher_floor_is_refused(way: str, reports: dict[str, str]) -> None:
    planted = PLANTED[way]
    assert planted.said in reports[planted.tool]


def test_nothing_else_is_refused(reports: dict[str, str]) -> None:
    importers = {
        name: set(re.findall(r"vkbloom\.([\w.]+)(?: ->|, line)", reports[name]))
        for name in ("floors", "no imports of vkbloom")
    }
    importers["TID251"] = {
        file.replace("/", ".") for file in re.findall(r"vkbloom/([\w/]+)\.py:", reports["TID251"])
    }
    for tool, modules in importers.items():
        assert modules == {planted.module for planted in PLANTED.values() if planted.tool == tool}


def test_imports_by_a_string_stay_in_the_callers_package() -> None:
    """What `own_module` and registries import no linter knows, nor `__import__`."""
    calls = {
        f"{file.relative_to(PACKAGE)}: {call}": argument
        for file in PACKAGE.rglob("*.py")
        for call, argument in re.findall(
            r"(?<!def )\b(own_module|supply|attach_stub|__import__)\(\s*([^,)]+)", file.read_text()
        )
    }
    assert "_methods/__init__.py: supply" in calls
    # That which a package supplies.
    assert calls.pop("_settings/registry.py: own_module") == "self._package"
    assert set(calls.values()) == {"__package__", "__name__"}
