"""The browser of the explorer's tests."""

from __future__ import annotations

import shutil

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE = 60.0  # seconds: waiting costs nothing where a busy machine answers at last
