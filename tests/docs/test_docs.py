"""The documentation: its code runs unchanged, and so do the example notebooks."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from tools.tables.cells import merge_rows

from tests.docs.pages import ROOT, TEXTS, blocks
from vkbloom import Renderer, Scene, Separable, presets

# test_guide.py runs the code of testing.md, which is files of tests.
PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    if page.name != "testing.md" and "```python" in page.read_text()
]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


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


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_code_of_a_notebook(path: Path, folder: Path, kept_renderers: None) -> None:
    names: dict[str, Any] = {"__name__": "notebook"}
    for cell in code_cells(path):
        exec("".join(line for line in cell["source"] if not line.startswith("%")), names)


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if not target.startswith(("http:", "https:", "#")):
            assert (page.parent / target.partition("#")[0]).exists(), target


@pytest.mark.parametrize("name", ["check", "measured", "stability", "resolution"])
def test_every_preset_has_a_row(name: str) -> None:
    """tools/tables/write.py --presets adds those that are missing."""
    text = (ROOT / "docs" / "evidence" / f"{name}_table.md").read_text()
    assert {*re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)} == {*presets}


def test_rows_of_chosen_presets_replace_theirs() -> None:
    head = "On a CPU.\n\n| preset | gain |\n| --- | --- |\n"
    old = f"{head}| `a` | 1 |\n| `b` | 2 |\n"
    new = f"{head}| `b` | 3 |\n| `c` | 4 |\n"
    assert merge_rows(old, new) == f"{head}| `a` | 1 |\n| `b` | 3 |\n| `c` | 4 |\n"
    with pytest.raises(ValueError, match="not the head"):
        merge_rows(old, new.replace("gain", "light"))


def test_titles_name_a_task() -> None:
    """A title says what its page is for, not only what it is about."""
    docs = (one for one in TEXTS if one.is_relative_to(ROOT / "docs"))
    pages = [one for one in docs if one.name not in ("index.md", "README.md")]
    titles = [
        text.partition("\n")[0]
        for one in pages
        for text in [one.read_text()]
        if text.startswith("# ")  # tables that pages include have none
    ]
    assert len(set(titles)) == len(titles) > 40
    assert [title for title in titles if len(title.split()) < 4] == []


def test_the_notebook_for_class_has_six_answers() -> None:
    """Each is between its question and its check, and has the tag by which it can be removed."""
    cells = json.loads((ROOT / "examples" / "exercises.ipynb").read_text())["cells"]
    text = "".join("".join(cell["source"]) + "\n" for cell in cells)
    assert re.findall(r"^## (\d)\.", text, re.MULTILINE) == [*"123456"]
    answers = [at for at, one in enumerate(cells) if "answer" in one["metadata"].get("tags", ())]
    assert len(answers) == 6
    assert all("assert " in "".join(cells[at + 1]["source"]) for at in answers)
    page = (ROOT / "docs" / "class.md").read_text()
    assert re.findall(r"^\| (\d)\. ", page, re.MULTILINE) == [*"123456"]


def test_the_first_commands_overwrite_nothing() -> None:
    """Who pastes all of them has a picture of each."""
    lines = blocks(ROOT / "README.md", "sh")[0].splitlines()
    written = [line.split()[3] for line in lines]
    assert len(written) == len({*written}) > 3
    assert {"mist", "star6", "film_halation"} <= {*" ".join(lines).split()}


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_how_to_cite(page: str) -> None:
    """The first pages, CITATION.cff and the package say the same."""
    yaml = pytest.importorskip("yaml")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "abstract"} <= {*cited}
    package = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert (cited["version"], cited["license"]) == (package["version"], package["license"])
    (entry,) = blocks(ROOT / page, "bibtex")
    for name in ("title", "version", "license"):
        assert f"  {name} = {{{cited[name]}}}" in entry
    assert f"{{{{{cited['authors'][0]['name']}}}}}" in entry


def test_the_flowchart_is_the_plan_s(monkeypatch: pytest.MonkeyPatch) -> None:
    """tools/docs_pictures.py writes it."""
    monkeypatch.setenv("VKBLOOM_VARIANT", "fragment")
    with Renderer() as renderer:
        plan = renderer.plan(Scene.ufo(), Separable(), (640, 360))
    assert blocks(ROOT / "docs" / "plans.md", "mermaid") == [plan.to_mermaid() + "\n"]
