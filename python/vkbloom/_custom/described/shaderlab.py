"""ShaderLab: the programs in HLSL of a file of Unity."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from typing import Final

from vkbloom._custom.described.files import Files, without_remarks

_BLOCK: Final = re.compile(r"\b(HLSLINCLUDE|CGINCLUDE|HLSLPROGRAM|CGPROGRAM)\b|\b(ENDHLSL|ENDCG)\b")
_PRAGMA: Final = re.compile(r"^[ \t]*#[ \t]*pragma[ \t]+(vertex|fragment)[ \t]+(\w+)", re.MULTILINE)
_KERNEL: Final = re.compile(r"^[ \t]*#[ \t]*pragma[ \t]+kernel[ \t]+(\w+)([^\n/]*)", re.MULTILINE)
#: Unity's own compiler also takes the #pragma lines of what it includes.
_WITH_PRAGMAS: Final = re.compile(r"^([ \t]*#[ \t]*include)_with_pragmas\b", re.MULTILINE)
_SUBSHADER: Final = re.compile(r"\bSubShader\b")


@dataclasses.dataclass(frozen=True)
class Program:
    """The text of a program, with what is included before it, and the names of its entries."""

    text: str
    vertex: str | None
    fragment: str | None


def read_program(files: Files, number: int) -> Program:
    """Return a program of a file by its number, counted from 0."""
    text = files.main.text
    plain = without_remarks(text)
    shared: list[tuple[int, str]] = []
    programs: list[tuple[int, str]] = []
    for start, kind, begin, end in _blocks(files):
        part = text[begin:end]
        if part.startswith("\n"):
            # The number of the line after this one.
            line = text.count("\n", 0, begin) + 2
            part = f'#line {line} "{files.main.name}"{part}'
        (shared if kind.endswith("INCLUDE") else programs).append((start, part))
    if number >= len(programs):
        raise files.fault(
            "",
            1,
            f"program: the file has {len(programs)} programs in HLSL, and so no number {number}",
        )
    place, program = programs[number]
    # What the SubShader of the program shares, or what is before all of them.
    begun = max(
        (each.start() for each in _SUBSHADER.finditer(plain) if each.start() < place), default=0
    )
    first = min((each.start() for each in _SUBSHADER.finditer(plain)), default=0)
    parts = [part for start, part in shared if start < place and (start > begun or start < first)]
    joined = _WITH_PRAGMAS.sub(r"\1", "\n".join((*parts, program)))
    # The last of each kind: a program's own come after those of what it shares.
    names = dict(_PRAGMA.findall(joined))
    return Program(joined, names.get("vertex"), names.get("fragment"))


def read_kernels(files: Files) -> dict[str, dict[str, str]]:
    """Return the entry points of a compute shader of Unity, and what each of them defines."""
    found = {}
    for name, words in _KERNEL.findall(without_remarks(files.main.text)):
        parts = [word.partition("=") for word in words.split()]
        found[name] = {word: value or "1" for word, _, value in parts}
    return found


def _blocks(files: Files) -> Iterator[tuple[int, str, int, int]]:
    """Return where each block starts, its kind, and where its text begins and ends."""
    text = without_remarks(files.main.text)
    opened: re.Match[str] | None = None
    for match in _BLOCK.finditer(text):
        if opened is None and match[1]:
            opened = match
        elif opened is not None and match[2]:
            yield opened.start(), opened[1], opened.end(), match.start()
            opened = None
    if opened is not None:
        line = text.count("\n", 0, opened.start()) + 1
        end = "ENDCG" if opened[1].startswith("CG") else "ENDHLSL"
        raise files.fault("", line, f"{opened[1]} has no end; {end} is missing")
