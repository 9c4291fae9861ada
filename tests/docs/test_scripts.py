"""Every script of tools/, benchmarks/ and examples/ runs, in its shortest form.

Each runs as a program in this process. Of presets and glares it finds a few, if it asks for all.
"""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np
import pytest

import vkbloom
from tests.docs.pages import ROOT
from tests.exhaustive import witness
from vkbloom._public import defining_module

#: The arguments of a script, in a folder with `photo.exr`; a module that it cannot do without.
RUN: Final[dict[str, tuple[str, str]]] = {
    "benchmarks/grid.py": ("points", "distributed"),
    "examples/demo.py": ("--out out", "OpenImageIO"),
    "examples/gradients/glare_removal.py": ("a.png", "scipy"),
    "examples/gradients/learned.py": ("a.png", "torch"),
    "examples/gradients/recovered_psf.py": ("a.png", "scipy"),
    "tools/docs_pictures.py": ("pictures", "matplotlib"),
    "tools/laws.py": ("--out a.md", "cv2"),
    "tools/look_sheet.py": ("sheet.png photo.jpg --looks soft", "matplotlib"),
    "tools/line_counts.py": ("", "numpy"),
    "tools/requirements.py": ("all", "numpy"),
    "tools/run_notebooks.py": ("", "nbclient"),
    "tools/static_explorer.py": ("page --quick", "skimage"),
    "tools/where_it_has_run.py": ("--out .", "numpy"),
    "tools/tables/write.py": ("--quick --out .", "skimage"),
}


#: Those that take more than five seconds of a processor; their functions have tests of their own.
LONG: Final = ("tools/tables/write.py",)

#: What is run elsewhere, by its path or folder, and where: a test, a target of make.
ELSEWHERE: Final = {
    "benchmarks/": "tests/bench/test_bench.py",
    "examples/cluster/": "tools/cluster/run.py",
    "examples/gallery/": "tests/docs/test_gallery.py",
    "examples/image_quality/": "tests/plugin/test_guide.py",
    "examples/custom_methods/": "tests/custom/test_rendering.py",
    "examples/training_pairs.py": "tests/device/test_training_pairs.py",
    "tools/cluster/": "Makefile",
    "tools/docs_versions.py": "tests/docs/test_first_page.py",
    "tools/core_tables.py": "tests/core/test_no_core.py",
    "tools/picture_sheet.py": "tools/docs_pictures.py",
    "tools/preset_blooms.py": "tests/custom/test_check.py",
    "tools/coverage.sh": "docs/robustness.md",  # compiles and runs for minutes
    "tools/coverage_report.py": "tools/coverage.sh",
    "tools/engines/": "Makefile",
    "tools/free_threaded/": "Makefile",
    "tools/fuzz/": "tests/io/test_fuzz.py",
    "tools/import_contracts.py": "tests/core/test_floors.py",
    "tools/libplacebo/": "Makefile",
    "tools/mesa_backports.sh": "tests/device/amd_families.py",
    "tools/renderer_memory.py": "tests/core/test_lifetime.py",
    "tools/sanitize.sh": "Makefile",
    "tools/sanitizer_report.py": "tools/sanitize.sh",
    "tools/setup_system.sh": "Makefile",
    "tools/tables/": "tools/tables/write.py",
    "tools/threads/": "Makefile",
}


class Few(Mapping[str, Any]):
    """All of a mapping by name, and a few as its items."""

    def __init__(self, every: Mapping[str, Any], *names: str) -> None:
        self.every, self.names = every, names

    def __getitem__(self, name: str) -> Any:
        return self.every[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@pytest.mark.parametrize(
    "script",
    [pytest.param(one, marks=witness("takes 8 s and more") if one in LONG else ()) for one in RUN],
)
def test_a_script_runs(
    script: str, folder: Path, kept_renderers: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, needed = RUN[script]
    hint = "; run make test-torch" if needed == "torch" else ""
    pytest.importorskip(needed, reason=f"{needed} is not installed{hint}")
    (folder / "pictures").mkdir()
    shutil.copy(ROOT / "docs" / "plans.md", folder)  # a script writes its flowchart
    monkeypatch.setattr(vkbloom, "presets", Few(vkbloom.presets, "kino", "unity_urp"))
    monkeypatch.setattr(vkbloom, "glares", Few(vkbloom.glares, next(iter(vkbloom.glares))))
    for name, value in {"GRID_SIDE": "16", "GRID_COUNTS": "2,2,2", "GRID_SINGLES": "2"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "argv", [script, *words.split()])
    monkeypatch.syspath_prepend(str((ROOT / script).parent))
    monkeypatch.syspath_prepend(str(ROOT))
    status: Any = None
    try:
        runpy.run_path(str(ROOT / script), run_name="__main__")
    except SystemExit as ended:
        status = ended.code
    assert not status


def list_scripts(*folders: str) -> list[str]:
    """Return the scripts of folders of the checkout."""
    if not (ROOT / ".git").exists():
        pytest.skip("this is no checkout")
    command = ["git", "ls-files", "--", *folders]
    text = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    every = [name for name in text.splitlines() if name.endswith((".py", ".sh", ".sbatch"))]
    return [name for name in every if (ROOT / name).exists()]


def test_no_script_is_left_out() -> None:
    every = list_scripts("tools", "benchmarks", "examples")
    assert [
        name for name in every if name not in RUN and not name.startswith(tuple(ELSEWHERE))
    ] == []
    assert [name for name in RUN if name not in every] == []
    guarded = [name for name in every if 'if __name__ == "__main__"' in (ROOT / name).read_text()]
    programs = [name for name in guarded if name.startswith("benchmarks/")]
    assert {*programs} <= {*RUN, "benchmarks/__main__.py"}
    for place, runner in ELSEWHERE.items():
        assert any(name.startswith(place) for name in every), place
        # The word by which the runner finds it.
        assert Path(place).stem in (ROOT / runner).read_text(), (place, runner)


def test_shell_scripts_parse() -> None:
    for name in list_scripts("tools", "examples", "packaging", ".ci"):
        if not name.endswith(".py"):
            subprocess.run(["bash", "-n", ROOT / name], check=True)


# The examples in docstrings run as written.


FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def modules() -> Iterator[str]:
    """The modules of the package and its plugin."""
    yield "vkbloom"
    for found in pkgutil.walk_packages(vkbloom.__path__, "vkbloom."):
        if not found.name.endswith(("__main__", "._core")):
            yield found.name
    yield "pytest_vkbloom"


class Finder(doctest.DocTestFinder):
    """Finds the examples of public names where these are defined."""

    def _from_module(self, module: ModuleType | None, thing: Any) -> bool:
        if module is not None and (inspect.isclass(thing) or inspect.isfunction(thing)):
            return defining_module(thing) == module.__name__
        return super()._from_module(module, thing)  # type: ignore[misc, no-any-return]


def examples_in(module: ModuleType) -> list[doctest.DocTest]:
    """The examples of a module, with the names that they use without importing them."""
    names = {"np": np, "vkbloom": vkbloom}
    found = Finder(exclude_empty=True).find(module, extraglobs=names)
    return [test for test in found if test.examples]


@pytest.mark.parametrize("name", list(modules()))
def test_examples_of_a_module(name: str, request: pytest.FixtureRequest) -> None:
    if name.endswith((".torch", ".operators")):
        pytest.importorskip("torch", reason="PyTorch is not installed; run make test-torch")
    module = importlib.import_module(name)
    report: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS, verbose=False)
    tests = examples_in(module)
    if any('"software"' in one.source for test in tests for one in test.examples):
        request.getfixturevalue("software")  # skips where there is none
    if name not in (
        "vkbloom._renderer.renderer",
        "vkbloom._renderer.surface",
    ):  # they show what closing does
        request.getfixturevalue("kept_renderers")
    for test in tests:
        runner.run(test, out=report.append)
    assert runner.failures == 0, "".join(report)
