"""Run in a process of its own: wesl-py makes WGSL of WESL. It imports nothing of the package."""

from __future__ import annotations

import json
import sys
from pathlib import Path


def main() -> int:
    """Print the WGSL of what the standard input says, a line of JSON each; return the status.

    After an error nothing more is printed.
    """
    import wesl  # noqa: PLC0415  in this process alone

    for asked in json.loads(sys.stdin.read()):
        try:
            path = Path(asked["file"])
            root = asked["dependencies"].pop("package", path.parent)
            module = path.relative_to(root).with_suffix("")
            made = wesl.compile_source(
                asked["text"],
                root="::".join(("package", *module.parts)),
                filename=path,
                root_directory=root,
                features=asked["features"],
                constants=asked["constants"],
                dependencies=asked["dependencies"] or None,
            )
        except wesl.CompileError as error:
            first = error.diagnostics[0]
            print(f"VKBLOOM-ERROR\n{first.filename or ''}\n{first.line or 1}\n{first.message}")
            return 1
        print(json.dumps(made.wgsl), flush=True)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Exception as error:  # of any kind: the other process shows it
        print(f"VKBLOOM-ERROR\n\n1\n{error}")
        sys.exit(1)
