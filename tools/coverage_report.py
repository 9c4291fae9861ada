"""Print line and branch coverage of each file of csrc, and list the lines not reached.

``python coverage_report.py TREE LIST``: TREE is a tree that was built with ``--coverage`` and run.
"""

from __future__ import annotations

import gzip
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

#: Files that exist only for tests.
LEFT_OUT = {"faults.c", "faults.h"}


def main(tree: Path, listed: Path) -> int:
    """Print a table of lines and branches by file."""
    counts = sorted(tree.glob("build/**/csrc/*/*.gcda"))
    lines: dict[str, dict[int, int]] = defaultdict(dict)
    branches: dict[str, list[int]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        for file in counts:
            subprocess.run(
                ["gcov", "--json-format", "--branch-probabilities", str(file.resolve())],
                cwd=folder,
                check=True,
                capture_output=True,
            )
        for report in sorted(Path(folder).glob("*.gcov.json.gz")):
            for each in json.loads(gzip.decompress(report.read_bytes()))["files"]:
                path = Path(each["file"])
                if path.parent.parent.name != "csrc" or path.name in LEFT_OUT:
                    continue
                name = f"{path.parent.name}/{path.name}"
                for line in each["lines"]:
                    number = line["line_number"]
                    kept = lines[name].get(number, 0)
                    lines[name][number] = kept + line["count"]
                    branches[name] += [branch["count"] for branch in line["branches"]]
    print(f"{'file':<30}{'lines':>7}{'reached':>9}{'branches':>10}{'taken':>9}")
    missed: list[str] = []
    for name in sorted(lines):
        source = (tree / "csrc" / name).read_text().splitlines()
        row(name, list(lines[name].values()), branches[name])
        missed += [
            f"{name}:{number}: {source[number - 1].strip()}"
            for number, count in sorted(lines[name].items())
            if not count
        ]
    everything = [count for file in lines.values() for count in file.values()]
    row("all", everything, [count for file in branches.values() for count in file])
    listed.write_text("\n".join(missed) + "\n")
    print(f"{len(missed)} lines not reached: {os.path.relpath(listed)}")
    return 0


def row(name: str, lines: list[int], branches: list[int]) -> None:
    """Print one row of the table."""
    reached = sum(map(bool, lines)) / max(1, len(lines))
    taken = sum(map(bool, branches)) / max(1, len(branches))
    print(f"{name:<30}{len(lines):>7}{reached:>9.1%}{len(branches):>10}{taken:>9.1%}")


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
