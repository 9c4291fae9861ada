"""The GitHub Action and the hook of pre-commit, run as shell on a repository with one shader."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.core.builds import ROOT

yaml = pytest.importorskip("yaml")

SHADER = (ROOT / "examples" / "custom_methods" / "forty_lines.hook").read_text()
# Changes of it: a narrower blur, and one that adds a sixth to a flat image.
GOOD = SHADER.replace("2.5\n//!HOOK", "2.0\n//!HOOK")
BAD = SHADER.replace("return sum / total;", "return 1.08 * sum / total;")
OPTIONS = "--measure-size 64x64 --size 64x48"


def git(folder: Path, *words: str) -> str:
    who = ["-c", "user.name=a", "-c", "user.email=a@b"]
    done = subprocess.run(
        ["git", *who, *words], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


def commit(folder: Path, text: str, name: str = "bloom.hook") -> None:
    (folder / name).write_text(text)
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "change")


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """Return a shallow clone of a repository whose shader is that of the examples."""
    folder = tmp_path / "origin"
    folder.mkdir()
    git(folder, "init", "-q", "-b", "main")
    commit(folder, SHADER)
    return folder


def programs(tmp_path: Path) -> dict[str, str]:
    """Return an environment that has this Python and its package as programs."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "python").write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} "$@"\n')
    (folder / "vkbloom").write_text('#!/bin/sh\nexec python -m vkbloom "$@"\n')
    for program in folder.iterdir():
        program.chmod(0o755)
    return {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}"}


class Run:
    """Run the steps of action.yml in a repository, as GitHub's runner does."""

    def __init__(self, folder: Path, temporary: Path, inputs: dict[str, str]) -> None:
        self.action: dict[str, Any] = yaml.safe_load((ROOT / "action.yml").read_text())
        self.temporary, self.outputs = temporary, dict[str, str]()
        usual = {name: one.get("default", "") for name, one in self.action["inputs"].items()}
        self.known = {f"inputs.{name}": value for name, value in {**usual, **inputs}.items()}
        self.known["runner.temp"] = str(temporary)
        self.variables = {**programs(temporary), "RUNNER_TEMP": str(temporary)}
        for name in ("GITHUB_ENV", "GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY"):
            self.variables[name] = str(temporary / name)
            (temporary / name).touch()
        self.status, self.uploaded, self.printed = 0, "", ""
        for step in self.action["runs"]["steps"]:
            self.step(step, folder)

    def value(self, text: str) -> str:
        return re.sub(r"\$\{\{ ([\w.]+) \}\}", lambda found: self.known.get(found[1], ""), text)

    def step(self, step: dict[str, Any], folder: Path) -> None:
        if "uses" in step:
            if step["uses"].startswith("actions/upload-artifact@"):
                self.uploaded = self.value(step["with"]["path"])
            return
        assert step["shell"] == "bash"
        environment = {name: self.value(text) for name, text in step.get("env", {}).items()}
        done = subprocess.run(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", self.value(step["run"])],
            cwd=folder,
            env={**self.variables, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        self.printed += done.stdout + done.stderr
        for line in (self.temporary / "GITHUB_OUTPUT").read_text().splitlines():
            name, _, value = line.partition("=")
            self.known[f"steps.{step.get('id')}.outputs.{name}"] = value
        for line in (self.temporary / "GITHUB_ENV").read_text().splitlines():
            name, _, value = line.partition("=")
            self.variables[name] = value
        (self.temporary / "GITHUB_OUTPUT").write_text("")
        self.status = done.returncode
        assert done.returncode == 0 or step["name"] == "Judge", self.printed


@pytest.mark.parametrize(("text", "status"), [(GOOD, 0), (BAD, 1)], ids=["good", "bad"])
def test_a_change_is_compared_with_its_base(
    repository: Path, tmp_path: Path, text: str, status: int
) -> None:
    base = git(repository, "rev-parse", "HEAD")
    commit(repository, text)
    git(tmp_path, "clone", "-q", "--depth", "1", f"file://{repository}", "clone")
    temporary = tmp_path / "runner"
    temporary.mkdir()
    inputs = {"shader": "bloom.hook", "against": base, "options": OPTIONS, "install": "numpy"}
    run = Run(tmp_path / "clone", temporary, {**inputs, "require": "gain,finite"})
    assert run.status == status, run.printed
    assert run.known["steps.check.outputs.status"] == str(status)
    summary = (temporary / "GITHUB_STEP_SUMMARY").read_text()
    assert summary == (Path(run.uploaded) / "report.md").read_text()
    assert summary.startswith("### `bloom` against `")
    assert ("Broken: gain" in summary) == bool(status)
    assert json.loads((Path(run.uploaded) / "report.json").read_text())


def test_a_new_shader_is_checked_alone(repository: Path, tmp_path: Path) -> None:
    commit(repository, SHADER, "new.hook")
    temporary = tmp_path / "runner"
    temporary.mkdir()
    inputs = {"shader": "new.hook", "against": "HEAD~1", "options": OPTIONS, "install": "numpy"}
    run = Run(repository, temporary, {**inputs, "require": "finite"})
    assert run.status == 0, run.printed
    assert "new.hook is new" in run.printed


@pytest.mark.parametrize(("law", "status"), [("finite", 0), ("gain", 1)])
def test_the_hook_of_pre_commit_checks_each_file(
    repository: Path, tmp_path: Path, law: str, status: int
) -> None:
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    (repository / "with a space.hook").write_text(BAD)
    words = [*OPTIONS.split(), "--require", law, "with a space.hook", "bloom.hook"]
    done = subprocess.run(
        [*shlex.split(hook["entry"]), *words],
        cwd=repository,
        env=programs(tmp_path),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == status, done.stderr
    assert done.stdout.count("superposition") >= 2
    assert re.search(hook["files"], "shaders/bloom.hook")
