"""The cases of ``vkbloom doctor --self-test``, under validation, and what the command prints."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from tests.device.exceptions import reason_against
from tests.variants import open_variant
from vkbloom import Renderer
from vkbloom._doctor import self_test
from vkbloom._doctor.cases import Case, cases
from vkbloom._doctor.deviations import deviation

CASES = {f"{case.group}: {case.name}": case for case in cases()}


@pytest.fixture(scope="module")
def fragment() -> Iterator[Renderer]:
    with open_variant("fragment") as renderer:
        yield renderer


@pytest.mark.parametrize("name", CASES)
def test_cases(request: pytest.FixtureRequest, name: str) -> None:
    case = CASES[name]
    if reason := reason_against(name):
        pytest.xfail(reason)
    renderer = request.getfixturevalue("renderer" if case.variant == "auto" else case.variant)
    assert self_test.judge(case, renderer)["wrong"] == ""


def test_there_are_about_200() -> None:
    assert len(CASES) == sum(1 for _ in cases()), "two have one name"
    assert 190 <= len(CASES) <= 240


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(self_test, "run", partial(self_test.run, only="masks: pyramid"))


@pytest.mark.usefixtures("few")
def test_the_command(tmp_path: Path) -> None:
    file = tmp_path / "report.json"
    ended = run("doctor", "--self-test", "--json", str(file))
    assert ended.exit_code == 0, ended.output
    assert "3 cases in" in ended.stdout
    found = json.loads(file.read_text())
    with vkbloom.Renderer() as renderer:
        assert vkbloom.AdapterInfo(**found["device"]) == renderer.info
    (group,) = found["groups"]
    assert (group["name"], group["cases"], group["wrong"]) == ("masks", 3, 0)
    assert 0 <= group["largest_error"] <= group["allowed"]
    ended = run("doctor", "--self-test", "--json")
    assert json.loads(ended.stdout)["passed"] is True


def test_an_adapter_that_does_not_open() -> None:
    command = ["doctor", "--self-test", "--adapter", "nonsense"]
    ended = run(*command)
    assert ended.exit_code == 1
    assert 'no Vulkan adapter for "nonsense"' in ended.stdout


def test_a_crash_is_told_with_its_case(monkeypatch: pytest.MonkeyPatch) -> None:
    crash = (
        "import os, sys; from vkbloom._doctor import self_test\n"
        "self_test.judge = lambda *_: os.abort()\n"
        "sys.argv[1:] = ['auto', 'NaN']; self_test.main()"
    )
    monkeypatch.setattr(self_test, "PROGRAM", ("-c", crash))
    *_, last = self_test.run("auto")
    assert last["name"] == "pyramid, uint8"
    assert "ended with status -6" in last["wrong"]


@pytest.mark.parametrize("wrong", [np.nan, 2.0])
def test_what_is_wrong_comes_first(wrong: float) -> None:
    """The first wrong framebuffer in the data flow, although a later one is farther off."""
    values = np.zeros((2, 2, 4))
    changed: Any = values.copy()
    changed[1, 0, 2] = wrong
    found = [
        deviation("glow", values, values, 1.0),
        deviation("up_0", changed, values, 1.0),
        deviation("final", values + 9, values, 1.0),
    ]
    results = self_test.judge(Case("group", "name", lambda _: found), None)  # type: ignore[arg-type]
    assert results["wrong"].startswith("up_0: ")
    assert json.loads(json.dumps(results, allow_nan=False)) == results
