"""The blocks of a file: each has a header of directives and a body."""

from __future__ import annotations

import dataclasses
import re
from typing import Final

from vkbloom._custom import hints
from vkbloom._custom.source import Source

MARK: Final = "//!"

#: The directives of each kind of block. A block whose first directive is none of the first three
#: names is a pass. A directive begins with one of the names; no blank is needed after it.
DIRECTIVES: Final = {
    "TEXTURE": ("TEXTURE", "SIZE", "FORMAT", "FILTER", "BORDER", "STORAGE"),
    "BUFFER": ("BUFFER", "VAR", "STORAGE"),
    "PARAM": ("PARAM", "DESC", "MINIMUM", "MAXIMUM", "TYPE"),
    "PASS": (
        "HOOK",
        "BIND",
        "SAVE",
        "DESC",
        "OFFSET",
        "WIDTH",
        "HEIGHT",
        "WHEN",
        "COMPONENTS",
        "COMPUTE",
    ),
}


@dataclasses.dataclass(frozen=True)
class Directive:
    """A line of a header: its name, and the rest of the line without blanks around it."""

    source: Source
    name: str
    value: str
    line: int

    def identifier(self) -> str:
        """Return the value; raise ValueError if it is not a name in GLSL."""
        if not self.value:
            raise self.fault("the name is missing")
        if not re.fullmatch(r"[A-Za-z_]\w*", self.value, re.ASCII):
            raise self.refusal("is not a name; it needs letters, digits and _")
        if self.value.startswith("gl_") or "__" in self.value:
            raise self.refusal("is reserved in GLSL")
        return self.value

    def fault(self, cause: object) -> ValueError:
        """Return the error of the line."""
        return self.source.fault(self.line, f"{self.name}: {cause}")

    def refusal(self, cause: str) -> ValueError:
        """Return the error of the value."""
        return self.fault(f"{self.value!r} {cause}")


@dataclasses.dataclass(frozen=True)
class Block:
    """A block; `line` is that of its first directive, `body_line` that of the body's first one."""

    kind: str
    directives: tuple[Directive, ...]
    body: str
    line: int
    body_line: int

    @property
    def head(self) -> Directive:
        """The directive that names the block."""
        return self.directives[0]

    def fault(self, line: int, cause: str) -> ValueError:
        """Return the error of a line, which begins with the block's kind and name."""
        return self.head.source.fault(line, f"{self.kind} {self.head.value}: {cause}")

    def last(self, name: str) -> Directive | None:
        """Return the last directive of a name: of several, this one counts."""
        directives = self.all(name)
        return directives[-1] if directives else None

    def all(self, name: str) -> list[Directive]:
        """Return the directives of a name."""
        return [directive for directive in self.directives if directive.name == name]


def read_blocks(source: Source) -> list[Block]:
    """Split a file into its blocks. What comes before the first one is skipped."""
    text = source.text
    start = text.find(MARK)
    if start < 0:
        raise source.fault(
            1,
            f"the file has no line that begins with {MARK}, so no pass; see custom methods"
            + hints.for_text(source.name, text),
        )
    blocks = []
    line = text.count("\n", 0, start) + 1
    while start < len(text):
        block, start = read_block(source, start, line)
        line = block.body_line + block.body.count("\n")
        blocks.append(block)
    return blocks


def read_block(source: Source, start: int, line: int) -> tuple[Block, int]:
    """Read the block that begins at a position; return it with the position after it."""
    text, position, first = source.text, start, line
    kind = ""
    directives = []
    while position < len(text):
        end = text.find("\n", position)
        end = len(text) if end < 0 else end
        content = text[position:end].strip()
        if not content.startswith(MARK):
            break
        kinds = (kind for kind in DIRECTIVES if content.startswith(MARK + kind))
        kind = kind or next(kinds, "PASS")
        directives.append(read_directive(source, kind, content.removeprefix(MARK), line))
        position = min(end + 1, len(text))
        line += end < len(text)
    end = text.find(MARK, position)
    end = len(text) if end < 0 else end
    return Block(kind, tuple(directives), text[position:end], first, line), end


def read_directive(source: Source, kind: str, content: str, line: int) -> Directive:
    """Read a line of a header, without the mark."""
    for name in DIRECTIVES[kind]:
        if content.startswith(name):
            return Directive(source, name, content.removeprefix(name).strip(), line)
    word = (re.findall(r"\w+", content) or [content])[0]
    block = "a pass" if kind == "PASS" else f"a block {kind}"
    begun = any(content.startswith(names[0]) for names in DIRECTIVES.values())
    advice = "; an empty line must stand before a new block" if begun else ""
    raise source.fault(
        line, f"directive: {word!r} is not one of {block}: {', '.join(DIRECTIVES[kind])}{advice}"
    )
