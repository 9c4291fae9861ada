"""The documentation: its code runs unchanged, and so do the example notebooks."""

from __future__ import annotations

import json
import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import vkbloom
from tests.exhaustive import witness
from vkbloom import Renderer, Scene, Separable, presets, write
from vkbloom.cli.program import program
from vkbloom.io.image_writing import save
from vkbloom.io.images import Picture
from vkbloom.verdicts import measuring

ROOT = Path(__file__).resolve().parents[2]
TEXTS = [
    *sorted(ROOT.glob("*.md")),
    *sorted(ROOT.glob("*/*.md")),
    *sorted(ROOT.glob("python/*/*/*.md")),
]
# test_guide.py runs the code of testing.md, which is files of tests.
PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    if page.name != "testing.md" and "```python" in page.read_text()
]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
LONG = witness("the other notebooks take 9 s; the pages have the same calls")
# Commands of `sh` blocks that do not end, need a cluster, or are tested as they stand elsewhere
# (test_doctor.py): only their arguments are parsed.
ENDLESS = ("explore", "view", "doctor")
# What `vkbloom check` measures, for the same laws in less time.
SMALL = ["--measure-size", "64x64", "--size", "64x48"]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)


def commands() -> Iterator[Any]:
    """Yield the commands of all pages, each once."""
    found: list[list[str]] = []
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for block in blocks(page, "sh"):
            for line in block.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                if words[:1] == ["vkbloom"] and words not in found:
                    found.append(words)
                    yield pytest.param(words[1:], id=f"{page.name}: {line.split('#')[0].strip()}")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the files that pages name."""
    monkeypatch.chdir(tmp_path)
    # To find the nearest of all presets takes half a minute, to time large frames three seconds.
    monkeypatch.setattr(measuring, "presets", {"tutorial": presets["tutorial"]})
    timed = measuring.pass_times
    monkeypatch.setattr(measuring, "pass_times", lambda one, of, _: timed(one, of, (64, 36), 1))
    photo = (np.random.default_rng(0).random((24, 32, 3)) ** 8 * 20).astype(np.float16)
    save(Picture.of_values(photo, "half"), "photo.exr")
    write("photo.jpg", photo.astype(np.float32))
    np.save("picture.npy", photo)
    (grid,) = blocks(ROOT / "docs" / "grids.md", "toml")
    Path("grid.toml").write_text(grid)
    (own,) = blocks(ROOT / "docs" / "own_methods.md", "glsl")
    Path("soft.hook").write_text(own)
    (twin,) = [
        text for text in blocks(ROOT / "docs" / "own_methods.md", "python") if "def soft" in text
    ]
    Path("twin.py").write_text(twin)
    return tmp_path


# As in test_grid_cluster.py: objects that Dask's cluster leaves behind are its own.
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
# And so is its warning if its usual port is in use.
@pytest.mark.filterwarnings("ignore:Port:UserWarning")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_code_of_a_page(page: Path, folder: Path, kept_renderers: None) -> None:
    """Run a page's code from top to bottom, as one program."""
    names: dict[str, Any] = {"__name__": "page"}
    text = page.read_text()
    for block in blocks(page, "python"):
        line = text[: text.index(block)].count("\n")
        # Blank lines before it, so that a traceback names the page's own line.
        exec(compile("\n" * line + block, page, "exec"), names)


@pytest.mark.parametrize("words", list(commands()))
def test_commands_of_pages(words: list[str], folder: Path, kept_renderers: None) -> None:
    if words[0] in ENDLESS or "--scheduler" in words or "--from" in words:
        command = program.get_command(None, words[0])  # type: ignore[arg-type]
        assert command is not None
        command.make_context(words[0], words[1:], resilient_parsing=True)
        return
    result = CliRunner().invoke(program, [*words, *(SMALL if words[0] == "check" else [])])
    assert result.exit_code == 0, result.output


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A client of the kernel of all notebooks. (nbclient's validator alone loads for 8 s.)"""
    client = pytest.importorskip("jupyter_client.manager")
    pytest.importorskip("ipykernel")
    # The kernel runs elsewhere, and has to find the package that runs here.
    package = str(Path(vkbloom.__file__).parents[1])
    folder = str(tmp_path_factory.mktemp("ipython"))
    environment = {**os.environ, "PYTHONPATH": package, "IPYTHONDIR": folder}
    manager, opened = client.start_new_kernel(kernel_name="python3", env=environment)
    yield opened
    opened.stop_channels()
    manager.shutdown_kernel(now=True)
    manager.cleanup_resources()


def code_cells(path: Path) -> list[dict[str, Any]]:
    return [one for one in json.loads(path.read_text())["cells"] if one["cell_type"] == "code"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebooks_are_stored_as_run(path: Path) -> None:
    """From top to bottom, by tools/run_notebooks.py."""
    code = code_cells(path)
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    stored = [output for cell in code for output in cell["outputs"]]
    assert any("image/png" in output.get("data", {}) for output in stored)
    assert not any(output["output_type"] == "error" for output in stored)


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=() if path.stem == "forward_system" else LONG, id=path.name)
        for path in NOTEBOOKS
    ],
)
def test_notebook(path: Path, folder: Path, kernel: Any) -> None:
    shown: list[Any] = []
    sources = ("".join(cell["source"]) for cell in code_cells(path))
    for source in ("%reset -f", f"%cd {folder}", *sources):
        reply = kernel.execute_interactive(source, timeout=120, output_hook=shown.append)
        assert reply["content"]["status"] == "ok", reply["content"]
    contents = [message["content"] for message in shown]
    assert any("image/png" in content.get("data", {}) for content in contents)
    assert not any(content.get("name") == "stderr" for content in contents), contents


def test_the_front_page_gets_to_a_picture_in_ten_lines() -> None:
    (block,) = blocks(ROOT / "docs" / "index.md", "python")
    assert len([line for line in block.splitlines() if line]) < 10


def test_navigation() -> None:
    """At most twelve entries in four groups; the other pages are behind them."""
    trees = blocks(ROOT / "docs" / "index.md", "{toctree}")
    groups = [re.findall(r"^:caption: (.*)$", tree, re.MULTILINE)[0] for tree in trees]
    assert groups == ["Use", "Measure", "Extend", "Reference"]
    assert sum(len(re.findall(r"^[\w-]+$", tree, re.MULTILINE)) for tree in trees) <= 12


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if not target.startswith(("http:", "https:", "#")):
            assert (page.parent / target.partition("#")[0]).exists(), target


def test_the_flowchart_is_the_plan_s(monkeypatch: pytest.MonkeyPatch) -> None:
    """tools/docs_pictures.py writes it."""
    monkeypatch.setenv("VKBLOOM_VARIANT", "fragment")
    with Renderer() as renderer:
        plan = renderer.plan(Scene.ufo(), Separable(), (640, 360))
    assert blocks(ROOT / "docs" / "plans.md", "mermaid") == [plan.to_mermaid() + "\n"]
