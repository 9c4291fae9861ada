"""Run in a process of its own: wesl-py makes WGSL of WESL. It imports nothing of the package."""

from __future__ import annotations

import json
import sys

import wesl


def main() -> None:
    """Print the WGSL of what the standard input says."""
    asked = json.loads(sys.stdin.read())
    made = wesl.compile_file(
        asked["file"],
        features=asked["features"],
        dependencies=asked["dependencies"] or None,
    )
    print(made.wgsl)


if __name__ == "__main__":
    try:
        main()
    except wesl.CompileError as error:
        first = error.diagnostics[0]
        print(f"VKBLOOM-ERROR\n{first.filename or ''}\n{first.line or 1}\n{first.message}")
        sys.exit(1)
    except Exception as error:
        print(f"VKBLOOM-ERROR\n\n1\n{error}")
        sys.exit(1)
