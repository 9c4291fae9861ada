"""Compare a tag, such as v0.1.0, with the version in every file that says one.

Without a tag the files are compared with each other, and the changelog is not asked for a date.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
#: The files, and how each says the version.
PLACES: Final = {
    "pyproject.toml": r'^version = "(.+)"$',
    "CITATION.cff": r"^version: (.+)$",
    "README.md": r"^  version = \{(.+)\},$",
    "docs/index.md": r"^  version = \{(.+)\},$",
    "packaging/conda/recipe.yaml": r"^  version: (\d.*)$",
}


def problems(tag: str | None) -> list[str]:
    """Return what must be changed before a release."""
    versions = {}
    for name, pattern in PLACES.items():
        found = re.findall(pattern, (ROOT / name).read_text(), re.MULTILINE)
        versions[name] = found[0] if len(found) == 1 else f"found {len(found)} times"
    expected = versions["pyproject.toml"] if tag is None else tag.removeprefix("v")
    wrong = [
        f"{name}: the version is {version}, not {expected}"
        for name, version in versions.items()
        if version != expected
    ]
    if tag is not None:
        heading = rf"^## \[{re.escape(expected)}\] - \d{{4}}-\d\d-\d\d$"
        if not re.search(heading, (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE):
            wrong.append(f"CHANGELOG.md: there is no dated section [{expected}]")
        if not re.search(r"^date-released: ", (ROOT / "CITATION.cff").read_text(), re.MULTILINE):
            wrong.append("CITATION.cff: date-released is missing")
        if not tag.startswith("v"):
            wrong.append(f"the tag is {tag}, not v{expected}")
    return wrong


if __name__ == "__main__":
    found = problems(sys.argv[1] if len(sys.argv) > 1 else None)
    sys.exit("\n".join(found) if found else None)
