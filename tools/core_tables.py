"""Write the core's tables to the file that stands in for them where the core cannot be loaded."""

from __future__ import annotations

import json
from pathlib import Path

from vkbloom import _core

FILE = Path(__file__).parents[1] / "python" / "vkbloom" / "_core_tables.json"


def tables() -> str:
    """Return the core's constants as JSON."""
    found = {name: getattr(_core, name) for name in sorted(vars(_core)) if name.isupper()}
    lines = (f" {json.dumps(name)}: {json.dumps(value)}" for name, value in found.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


if __name__ == "__main__":
    FILE.write_text(tables())
