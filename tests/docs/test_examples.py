"""The examples in docstrings run as written."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

import vkbloom

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def modules() -> Iterator[str]:
    """The modules of the package and its plugin."""
    yield "vkbloom"
    for found in pkgutil.walk_packages(vkbloom.__path__, "vkbloom."):
        if not found.name.endswith(("__main__", "._core")):
            yield found.name
    yield "pytest_vkbloom"


def examples_in(module: ModuleType) -> list[doctest.DocTest]:
    """The examples of a module, with the names that they use without importing them."""
    names = {"np": np, "vkbloom": vkbloom}
    found = doctest.DocTestFinder(exclude_empty=True).find(module, extraglobs=names)
    return [test for test in found if test.examples]


@pytest.mark.parametrize("name", list(modules()))
def test_examples_of_a_module(name: str, request: pytest.FixtureRequest) -> None:
    if name.endswith((".torch", ".operators")):
        pytest.importorskip("torch", reason="PyTorch is not installed")
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
