"""What a release consists of: workflows, versions in files, the paper, what is supported."""

from __future__ import annotations

import importlib
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.core.builds import ROOT
from tests.docs.pages import TEXTS
from tests.processes import python

yaml = pytest.importorskip("yaml")

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PAPER = ROOT / "paper" / "paper.md"


@pytest.fixture
def packaging(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that imports a script of packaging/."""
    monkeypatch.syspath_prepend(ROOT / "packaging")
    return importlib.import_module


@pytest.mark.parametrize("path", [*WORKFLOWS, ROOT / "action.yml"], ids=lambda path: path.name)
def test_actions_are_pinned_by_a_commit_with_its_version(path: Path) -> None:
    for line in re.findall(r"uses: (.+)", path.read_text()):
        pinned = re.fullmatch(r"[\w.-]+/[\w.-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", line)
        assert pinned or line.startswith("./"), line


def test_the_files_say_the_same_version(packaging: Any) -> None:
    release_version = packaging("release_version")
    assert release_version.problems(None) == []
    wrong = release_version.problems("v99.0")
    assert len(wrong) > len(release_version.PLACES)
    assert "CHANGELOG.md: there is no dated section [99.0]" in wrong


WORKFLOW = """
jobs:
  use:
    needs: build
    strategy: {matrix: {name: [one, "two*"]}}
    steps:
      - uses: actions/download-artifact@0
        with: {name: made, path: all}
      - env: {NAME: "${{ matrix.name }}", ONE: "${{ matrix.name != 'two*' }}"}
        working-directory: all
        run: echo "$NAME $ONE" >used && cat file >>used
      - {env: {GH_TOKEN: "${{ github.token }}"}, run: touch "$GITHUB_WORKSPACE/sent"}
  build:
    steps:
      - {name: left out, run: exit 1}
      - if: startsWith(github.ref, 'refs/tags/v')
        run: mkdir dist && echo "$GITHUB_REF_NAME" >dist/file
      - {uses: actions/upload-artifact@0, with: {name: made, path: dist}}
"""


def test_a_workflow_runs_here(tmp_path: Path) -> None:
    (tmp_path / "a.yml").write_text(WORKFLOW)
    out = tmp_path / "out"
    words = [str(tmp_path / "a.yml"), "--tag", "v1", "--out", str(out), "--leave-out", "left out"]
    done = python("packaging/run_workflow.py", *words, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (out / "jobs/use-one/all/used").read_text() == "one true\nv1\n"
    assert (out / "jobs/use-two/all/used").read_text() == "two* false\nv1\n"
    assert not list(out.rglob("sent"))
    assert "would run: touch" in done.stdout
    (tmp_path / "a.yml").write_text(WORKFLOW.replace("dist/file\n", "dist/file; exit 3\n"))
    done = python("packaging/run_workflow.py", *words, cwd=ROOT)
    assert done.returncode != 0
    assert "build: status 3" in done.stderr


def test_the_release_has_no_step_that_cannot_be_run_here(packaging: Any) -> None:
    run_workflow = packaging("run_workflow")
    jobs = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())["jobs"]
    assert [name for name, _ in run_workflow.in_order(jobs)] == [*jobs]
    for job in jobs.values():
        for one in (job, *job["steps"]):
            assert one.get("if", run_workflow.CONDITION) == run_workflow.CONDITION
            action = re.sub(r"\W", "_", one.get("uses", "actions/checkout").partition("@")[0])
            assert hasattr(run_workflow.Job, action)


def floors(requirements: list[str]) -> dict[str, str]:
    """Return the least version of each package, as pip and conda write it."""
    found = (re.match(r"([\w.-]+)\s*>=\s*([\w.]+)", one) for one in requirements)
    return {one[1]: one[2] for one in found if one}


def test_the_conda_recipe_needs_the_same_versions() -> None:
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text())
    expected = floors([*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["cli"]])
    expected["python"] = PROJECT["requires-python"].removeprefix(">= ")
    assert floors(recipe["requirements"]["run"]) == expected


def test_what_is_supported_is_what_the_package_asks_for() -> None:
    page = (ROOT / "docs" / "support.md").read_text()
    said = dict(re.findall(r"^\| (\S.*?) \| ([\d.]+) and later", page, re.MULTILINE))
    needs = floors(PROJECT["dependencies"])
    assert said["Python"] == PROJECT["requires-python"].removeprefix(">= ")
    assert said["NumPy"].removesuffix(".0") == needs["numpy"]
    assert said["Mesa (lavapipe)"] in (ROOT / "docs/evidence/drivers_table.md").read_text()
    (wheel,) = re.findall(r"Debian 12\) by `make test`, ([0-9.]+)", page)
    assert f"MESA={wheel}\n" in (ROOT / "packaging/versions.sh").read_text()


SECTIONS = ["Summary", "Statement of need", "State of the field", "Software design"]
SECTIONS += ["Research impact statement", "AI usage disclosure", "Acknowledgements", "References"]


def test_the_paper_s_figures_are_those_of_the_evidence() -> None:
    text = PAPER.read_text()
    pages = [page for page in TEXTS if page.parent.name == "evidence"]
    evidence = "".join(page.read_text() for page in pages)
    for row in re.findall(r"^\|.*\|$", text, re.MULTILINE):
        assert f"\n{row}\n" in evidence, row
    for picture in re.findall(r"\]\(\.\./docs/(pictures/\S+)\)", text):
        assert f"](../{picture})" in evidence, picture
    words = text.partition("\n---\n")[2].split()
    assert 750 <= len(words) <= 1750
    assert re.findall(r"^# (.+)$", text, re.MULTILINE) == SECTIONS
    entries = (ROOT / "paper/paper.bib").read_text().split("\n@")
    assert {re.findall(r"\{(\w+),", entry)[0] for entry in entries} == {
        *re.findall(r"@(\w+)[;\]]", text)
    }
    assert all("  doi = {10." in entry for entry in entries)
    authors = yaml.safe_load((ROOT / "CITATION.cff").read_text())["authors"]
    front = yaml.safe_load(text.split("---\n")[1])
    assert [one["name"] for one in front["authors"]] == [one["name"] for one in authors]
