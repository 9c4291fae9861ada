"""The documentation: its code runs unchanged, and so do the example notebooks."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import vkbloom
from tests.docs.pages import ROOT, TEXTS, blocks
from tests.exhaustive import witness
from vkbloom import Renderer, Scene, Separable

# test_guide.py runs the code of testing.md, which is files of tests.
PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    if page.name != "testing.md" and "```python" in page.read_text()
]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
LONG = witness("the other notebooks take 9 s; the pages have the same calls")


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
