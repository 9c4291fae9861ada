"""The command line: ``vkbloom <command>``; this module is what the installed script calls."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line and exit with its status: 0, 1 (failed) or 2 (wrong use)."""
    try:
        # Late, because the packages of the extra may be missing, which shall be one line.
        from vkbloom.cli.program import program  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name not in {"click", "rich", "tqdm"}:
            raise
        sys.exit(f"vkbloom: the command line needs {error.name}: pip install vkbloom[cli]")
    program()
