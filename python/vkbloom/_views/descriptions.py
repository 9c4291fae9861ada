"""Descriptions of a class's parameters: the first sentences in its docstring."""

from __future__ import annotations

import functools
import inspect
import itertools
import re
from collections.abc import Mapping


# By the text, not the class: a class of a file that is loaded again must not be kept.
@functools.lru_cache(maxsize=128)
def parameter_descriptions(docstring: str) -> Mapping[str, str]:
    """Return the first sentence about each parameter of a numpydoc docstring."""
    lines = inspect.cleandoc(docstring).splitlines()
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
