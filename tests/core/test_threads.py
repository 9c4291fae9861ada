"""Threads that make all calls of the core at once (all_calls.py): their pictures are exact."""

from __future__ import annotations

import sys

from tests.core.builds import ROOT
from tests.processes import output
from vkbloom import AdapterInfo


def test_sixteen_threads_in_random_order(software: AdapterInfo) -> None:
    """In a process of its own, because it registers a method."""
    arguments = ("-W", "error", "-m", "tests.core.all_calls", "160")
    printed = output(*arguments, cwd=ROOT, VKBLOOM_VALIDATED="1").splitlines()
    assert printed[0] == "160 calls in 16 threads, all exact:"
    # `make freethreaded`: the core leaves it off.
    has_gil = getattr(sys, "_is_gil_enabled", lambda: True)()
    assert printed[-1] == f"the GIL is {'on' if has_gil else 'off'}"
