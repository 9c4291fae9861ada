"""Python in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys


def python(*arguments: str, **changes: str) -> subprocess.CompletedProcess[str]:
    """Run the interpreter with these arguments and additional environment variables."""
    return subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, **changes},
        capture_output=True,
        text=True,
        check=False,
    )
