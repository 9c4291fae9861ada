"""Python in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Final

MAX_SECONDS: Final = 600  # seconds, after which a process that hangs is ended


def python(
    *arguments: str | Path, cwd: Path | str | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run the interpreter with these arguments and additional environment variables."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        timeout=MAX_SECONDS,
        capture_output=True,
        text=True,
        check=False,
    )


def output(*arguments: str | Path, cwd: Path | str | None = None, **environment: str) -> str:
    """Return what `python` prints, after a run without an error."""
    done = python(*arguments, cwd=cwd, **environment)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def open_descriptors() -> int:
    """Count them if /proc exists, without those that the driver keeps.

    A thread of Mesa writes its shader cache at any time. SwiftShader's compiler has one memory for
    all devices.
    """
    count = 0
    for name in os.listdir("/proc/self/fd"):
        try:
            target = os.readlink(f"/proc/self/fd/{name}")
            count += not any(part in target for part in ("mesa_shader_cache", "swiftshader_jit"))
        except FileNotFoundError:  # closed by now, as the folder's own is
            continue
    return count
