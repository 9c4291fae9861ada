"""Threads: all calls of the core at once (all_calls.py), and first calls (first_calls.py)."""

from __future__ import annotations

import ast
import sys

import pytest

from tests.core import first_calls
from tests.core.builds import ROOT
from tests.exhaustive import EXHAUSTIVE
from tests.processes import output
from vkbloom import AdapterInfo, Renderer


def test_sixteen_threads_in_random_order(software: AdapterInfo) -> None:
    """In a process of its own, because it registers a method."""
    arguments = ("-W", "error", "-m", "tests.core.all_calls", "160")
    # glibc overwrites memory that is freed.
    environment = {"VKBLOOM_VALIDATED": "1", "MALLOC_PERTURB_": "165"}
    printed = output(*arguments, cwd=ROOT, **environment).splitlines()
    assert printed[0] == "160 calls in 16 threads, all exact:"
    # `make freethreaded`: the core leaves it off.
    has_gil = getattr(sys, "_is_gil_enabled", lambda: True)()
    assert printed[-1] == f"the GIL is {'on' if has_gil else 'off'}"


@pytest.mark.parametrize("call", first_calls.CALLS)
def test_first_calls_in_threads(software: AdapterInfo, call: str) -> None:
    """Whatever a process makes at its first use is complete before another thread sees it."""
    if call == "to_xarray":
        # `make freethreaded` has none.
        pytest.importorskip("xarray", reason="xarray is not installed: pip install vkbloom[grid]")
    if call == "names" and not getattr(sys, "_is_gil_enabled", lambda: True)():
        # `importlib._bootstrap._load_unlocked` ends with a `pop` from `sys.modules`: a thread that
        # then imports a module of the package gets a KeyError, in one of eight processes.
        pytest.skip("Python 3.13 without the GIL takes a package out of sys.modules for a moment")
    for _ in range(50 if EXHAUSTIVE else 1):
        output("-W", "error", "-m", "tests.core.first_calls", call, cwd=ROOT)


def test_packages_import_none_of_their_modules() -> None:
    """A thread that imports a package's module waits for the package, with the module's lock held.

    If another thread imports this module for the package, Python gives one of them half of it.
    """
    found = []
    for file in (ROOT / "python" / "vkbloom").glob("*/__init__.py"):
        package = f"vkbloom.{file.parent.name}"
        for node in ast.parse(file.read_text()).body:
            own = isinstance(node, ast.ImportFrom) and (
                node.level or (node.module or "").startswith(package)
            )
            found += [package] if own else []
    # Programs start with one thread.
    assert {*found} == {"vkbloom._cli", "vkbloom._doctor"}


def test_each_device_of_lavapipe_has_an_instance(software: AdapterInfo) -> None:
    """Devices of one instance read each other's freed memory (Mesa 22.3.6)."""
    with Renderer("software") as one, Renderer("software") as other:
        shared = one._core.instance == other._core.instance
    assert shared == ("llvmpipe" not in software.name)
