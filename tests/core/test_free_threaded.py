"""Without the GIL: the core leaves it off, and is right in many threads (`make freethreaded`)."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(
    getattr(sys, "_is_gil_enabled", lambda: True)(), reason="this Python has the GIL"
)


def test_the_gil_stays_off() -> None:
    code = "import vkbloom, sys; sys.exit(sys._is_gil_enabled())"
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_threads_get_what_one_thread_gets() -> None:
    # (The module registers a method, which other tests must not find.)
    from tests.core import all_calls

    assert sum(all_calls.play(160).values()) == 160
