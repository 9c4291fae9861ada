"""The examples in docstrings: they run as written, and every public object has one."""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import pytest_vkbloom
import vkbloom
from vkbloom import psf, reductions, reference, testing

# Exceptions are documented in the core.
WITHOUT_EXAMPLE = {
    "Error",
    "AdapterNotFoundError",
    "DeviceLostError",
    "OutOfMemoryError",
    "ShaderError",
    "ValidationError",
}
# Classes whose methods have examples, too.
METHODS_OF = (
    vkbloom.Frames,
    vkbloom.Plan,
    vkbloom.Renderer,
    vkbloom.Scene,
    vkbloom.Settings,
    psf.PSF,
    testing.FrameRegression,
    testing.Probe,
    testing.Tolerances,
)
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


def public() -> Iterator[Any]:
    for owner in (vkbloom, testing, reference, reductions, psf):
        for name in owner.__all__:
            member = getattr(owner, name)
            is_documented = inspect.isclass(member) or inspect.isfunction(member)
            if is_documented and name not in WITHOUT_EXAMPLE:
                yield pytest.param(member, id=f"{owner.__name__}.{name}")
    yield pytest.param(pytest_vkbloom.frame_regression, id="frame_regression")


def with_methods() -> Iterator[Any]:
    """The public objects, and the public methods of some classes."""
    for parameters in public():
        yield parameters
        member = parameters.values[0]
        owners = inspect.getmro(member) if member in METHODS_OF else ()
        own = [owner for owner in owners if owner.__module__.startswith("vkbloom.")]
        for name in {name: None for owner in own for name in vars(owner)}:
            method = getattr(member, name)
            if not name.startswith("_") and (
                inspect.isfunction(method) or inspect.ismethod(method)
            ):
                yield pytest.param(method, id=f"{parameters.id}.{name}")


@pytest.mark.parametrize("member", list(with_methods()))
def test_public_objects_have_an_example(member: Any) -> None:
    """They also name related objects."""
    text = inspect.getdoc(member) or ""
    for section in ("Examples", "See Also"):
        assert f"{section}\n{'-' * len(section)}" in text, section
