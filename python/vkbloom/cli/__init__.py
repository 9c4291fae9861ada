"""The command line: ``vkbloom <command>``; this module is what the installed script calls."""

from __future__ import annotations

import io
import os
import signal
import sys
from importlib.util import find_spec


def main() -> None:
    """Run the command line and exit with its status: 0, 1 (failed), 2 (wrong use) or 130."""
    missing = [name for name in ("click", "rich", "tqdm") if find_spec(name) is None]
    if missing:
        needed = " and ".join(missing)
        sys.exit(f"vkbloom: the command line needs {needed}: pip install vkbloom[cli]")
    # Imported here because it needs the optional packages checked above.
    from vkbloom.cli.program import INTERRUPTED, program  # noqa: PLC0415

    # File names may hold characters that the terminal's encoding cannot represent.
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")
    signal.signal(signal.SIGTERM, _end)
    try:
        program()
    except SystemExit as error:
        if error.code == INTERRUPTED:
            # All files are closed. A normal exit would wait for threads that wait for the device.
            for stream in filter(None, (sys.stdout, sys.stderr)):
                stream.flush()
            os._exit(INTERRUPTED)
        raise


def _end(number: int, frame: object) -> None:
    """Remove unfinished files, and end as a signal ends a process."""
    writing = sys.modules.get("vkbloom.io.safe_writing")
    if writing is not None:
        writing.remove()
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
