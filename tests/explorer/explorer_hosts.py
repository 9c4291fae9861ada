"""The browser of the explorer's tests."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE = 60.0  # seconds: waiting costs nothing where a busy machine answers at last


def wait_until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline
