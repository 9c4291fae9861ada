"""What messages add where a file is not of passes, or is written as for another program."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path
from typing import Final

# The first bytes of pictures, and endings of their names.
_PICTURES: Final = (
    b"\xff\xd8\xff",
    b"\x89PNG",
    b"v/1\x01",
    b"II*\0",
    b"MM\0*",
    b"RIFF",
    b"#?RADIANCE",
)
_PICTURE_NAMES: Final = re.compile(
    r"\.(avif|bmp|exr|gif|hdr|heic|jp2|jpe?g|jxl|png|tga|tiff?|webp)", re.IGNORECASE
)
_SHADER: Final = re.compile(
    r"^\s*#version\b|\bgl_Frag(Color|Coord)\b|\bvoid\s+main(Image)?\s*\(|\bsampler2D\b",
    re.MULTILINE,
)
_PYTHON: Final = re.compile(r"^(from\s+[\w.]+\s+import|import\s+\w|def\s+\w+\()", re.MULTILINE)
_OPERATORS: Final = "+-*/%"
_NUMBER_OR_SIZE: Final = re.compile(r"\d[\d.]*|\w+(\.\w+)?")


def for_bytes(name: str, data: bytes) -> str:
    """Return what to do with a file that is no text."""
    if data.startswith(_PICTURES) or _PICTURE_NAMES.fullmatch(Path(name).suffix):
        return (
            "this is a picture, and a method is a text of passes (.hook); "
            f"'vkbloom apply {Path(name).name} OUT' adds bloom to a picture"
        )
    return "save the file as UTF-8"


def for_text(name: str, text: str) -> str:
    """Return what a text without passes needs; empty if it is not known what it is."""
    if Path(name).suffix == ".py" or (_PYTHON.search(text) and not _SHADER.search(text)):
        return (
            "; this is Python: vkbloom.testing.report(function) measures a bloom in Python, "
            "--command 'python FILE {input} {output}' a program, and --reference FILE.py:FUNCTION "
            "names the reference of a .hook"
        )
    if _SHADER.search(text):
        return (
            "; a fragment shader becomes a pass: begin with the lines //!HOOK MAIN, //!BIND GLOW "
            "and //!SAVE BLOOM, write 'vec4 hook()' that returns the colour in place of 'void "
            "main()', read GLOW_tex(GLOW_pos) in place of texture(sampler, uv), and leave out "
            "#version, in, out and sampler2D; or name the file .frag, and it is taken as it is"
        )
    return ""


def for_undeclared(cause: str, bound: Collection[str], known: Collection[str]) -> str:
    """Return how a texture is read whose plain name the compiler does not know."""
    match = re.search(r"'(\w+)' : (undeclared identifier|no matching)", cause)
    name = match[1] if match else ""
    base = re.sub(r"_(tex|texOff|raw|pos|pt|size)$", "", name)
    if name in bound:
        return f"; read the texture by {name}_tex({name}_pos) or {name}_texOff(vec2(1, 0))"
    if base not in bound and base in known:
        return f"; the pass needs the line //!BIND {base}"
    return ""


def for_expression(text: str) -> str:
    """Return how an expression in infix notation is written; empty if it is none."""
    words = re.sub(rf"([{re.escape(_OPERATORS)}()])", r" \1 ", text).split()
    # After one value, no operator has its operands in reverse Polish notation.
    is_infix = len(words) > 2 and words[1] in _OPERATORS
    if not (is_infix and _NUMBER_OR_SIZE.fullmatch(words[0])) and "(" not in words:
        return ""
    if len(words) == 3:
        return f"; operators come last (reverse Polish notation): {words[0]} {words[2]} {words[1]}"
    return "; operators come last (reverse Polish notation): GLOW.w 2 / for GLOW.w / 2"
