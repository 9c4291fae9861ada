"""The command line: ``vkbloom <command>``; this module is what the installed script calls."""

from __future__ import annotations

import os
import sys

from vkbloom._cli import interrupts


def main() -> None:
    """Run the command line and exit with its status: 0, 1 (failed), 2 (wrong use) or 130."""
    answers = interrupts.answer()
    try:
        _run()
    except KeyboardInterrupt:
        interrupts.leave()
    except SystemExit as error:
        if answers:
            interrupts.ignore()
        if error.code == interrupts.INTERRUPTED:
            # All files are closed. A normal exit would wait for threads that wait for the device.
            _flush()
            os._exit(interrupts.INTERRUPTED)
        # Python's own exit flushes too late to answer Ctrl-C, or a pipe that is closed.
        if not _flush() and error.code in (0, None):
            sys.exit(1)
        raise


def _run() -> None:
    import io  # noqa: PLC0415  all imports are made where Ctrl-C is answered
    import signal  # noqa: PLC0415
    from importlib.util import find_spec  # noqa: PLC0415

    missing = [name for name in ("click", "rich", "tqdm") if find_spec(name) is None]
    if missing:
        from vkbloom._cli import bare  # noqa: PLC0415

        sys.exit(bare.run(sys.argv[1:], missing))
    from vkbloom._cli.program import program  # noqa: PLC0415

    # File names may hold characters that the terminal's encoding cannot represent.
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")
    signal.signal(signal.SIGTERM, _end)
    program()


def _flush() -> bool:
    """Flush what was printed, and return whether it could be written."""
    is_written = True
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except (OSError, ValueError):
            # Python would flush it again at the exit, and print the error.
            is_written = False
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return is_written


def _end(number: int, frame: object) -> None:
    """Remove unfinished files, and end as a signal ends a process."""
    import signal  # noqa: PLC0415  as in _run

    writing = sys.modules.get("vkbloom._io.safe_writing")
    if writing is not None:
        writing.remove()
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
