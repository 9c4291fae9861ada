"""Print lines of code and of docstrings by folder; blank lines and comments are left out.

``python tools/line_counts.py [REVISION]`` counts the working tree, or a commit.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
C_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*|(\"(?:\\.|[^\"\\\n])*\")", re.DOTALL)
DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
C_SUFFIXES = (".c", ".h", ".comp", ".frag", ".vert", ".glsl", ".inc")


def python_counts(text: str) -> tuple[int, int]:
    """Return lines of code and of docstrings."""
    documented: set[int] = set()
    quoted: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            documented.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
        elif isinstance(node, ast.Constant | ast.JoinedStr) and node.end_lineno != node.lineno:
            quoted.update(range(node.lineno, (node.end_lineno or 0) + 1))
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    filled = {number for number, line in lines if line}
    comments = {number for number, line in lines if line.startswith("#")} - quoted
    return len(filled - documented - comments), len(documented & filled)


def c_counts(text: str) -> tuple[int, int]:
    """Return lines of code; C has no docstrings."""
    code = C_COMMENT.sub(lambda found: found[1] or "", text)
    return sum(bool(line.strip()) for line in code.splitlines()), 0


def files(revision: str | None) -> dict[str, str]:
    """Return the text of each counted file by its path."""

    def git(*words: str) -> str:
        run = subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True)
        return run.stdout

    listed = git("ls-tree", "-r", "--name-only", revision) if revision else git("ls-files")
    found = {}
    for name in listed.splitlines():
        file = ROOT / name
        if name.endswith((".py", *C_SUFFIXES)) and (revision or file.exists()):
            found[name] = git("show", f"{revision}:{name}") if revision else file.read_text()
    return found


def main() -> None:
    """Print the table."""
    code: Counter[str] = Counter()
    docs: Counter[str] = Counter()
    for name, text in files(sys.argv[1] if sys.argv[1:] else None).items():
        parts = name.split("/")[:-1] or ["."]
        counts = (python_counts if name.endswith(".py") else c_counts)(text)
        for depth in range(1, min(len(parts), 3 if parts[0] == "python" else 2) + 1):
            folder = "/".join(parts[:depth])
            code[folder] += counts[0]
            docs[folder] += counts[1]
    print("| folder | code | docstrings |\n|---|---:|---:|")
    for folder in sorted(code):
        print(f"| {folder} | {code[folder]:,} | {docs[folder]:,} |")


if __name__ == "__main__":
    main()
