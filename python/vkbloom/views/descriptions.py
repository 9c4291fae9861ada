"""Descriptions of a class's parameters: the first sentences in its docstring."""

from __future__ import annotations

import inspect
import itertools
import re

__all__ = ["described_parameters"]


def described_parameters(kind: type) -> dict[str, str]:
    """Return the first sentence about each parameter from a class's numpydoc docstring."""
    lines = inspect.cleandoc(kind.__doc__ or "").splitlines()
    texts: dict[str, list[str]] = {}
    names: list[str] = []
    start = lines.index("Parameters") + 2 if "Parameters" in lines else len(lines)
    for line, following in itertools.pairwise([*lines[start:], ""]):
        if following.startswith("---"):
            break
        if line.startswith(" "):
            for name in names:
                texts[name].append(line.strip())
        elif line:
            names = line.partition(" : ")[0].split(", ")
            texts.update({name: [] for name in names})
    return {
        name: re.split(r"\.(?:\s|$)", " ".join(text))[0].replace("`", "")
        for name, text in texts.items()
    }
