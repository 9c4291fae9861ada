"""Print the requirements of extras of pyproject.toml, with the package's own extras resolved.

The Makefile uses it to install packages once for each change of pyproject.toml, not for each build.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def requirements(*extras: str) -> list[str]:
    """List the requirements of the package with these extras."""
    project = tomllib.loads(PROJECT.read_text())["project"]
    found: dict[str, None] = dict.fromkeys(project["dependencies"])

    def add(name: str) -> None:
        for requirement in project["optional-dependencies"][name]:
            own = re.fullmatch(rf"{project['name']}\[(.*)\]", requirement)
            if own is None:
                found[requirement] = None
                continue
            for other in own[1].split(","):
                add(other.strip())

    for extra in extras:
        add(extra)
    return list(found)


if __name__ == "__main__":
    print("\n".join(requirements(*sys.argv[1:])))
