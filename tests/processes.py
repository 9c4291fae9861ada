"""Python in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Final

LONGEST: Final = 600  # seconds, after which a process that hangs is ended


def python(
    *arguments: str | Path,
    cwd: Path | str | None = None,
    **environment: str,
) -> subprocess.CompletedProcess[str]:
    """Run the interpreter with these arguments and additional environment variables."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        timeout=LONGEST,
        capture_output=True,
        text=True,
        check=False,
    )


def output(
    *arguments: str | Path,
    cwd: Path | str | None = None,
    **environment: str,
) -> str:
    """Return what `python` prints, after a run without an error."""
    done = python(*arguments, cwd=cwd, **environment)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
