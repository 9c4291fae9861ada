"""The lines of a TOML text on which its tables and keys begin, which tomllib does not tell."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Final

Path = tuple[str | int, ...]

_TOKEN: Final = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}'
    r"|'''.*?'{3,5}"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'"
    r"|#[^\n]*"
    r"|[^\s\[\]{}=,.\"'#]+"
    r"|\n|\S",
    re.DOTALL,
)


def find_lines(text: str) -> dict[Path, int]:
    """Return the line of each table, key and entry of a list; the text is valid TOML."""
    return _Scanner(text).scan()


class _Scanner:
    """Goes over the tokens of a text."""

    def __init__(self, text: str) -> None:
        self._tokens = _tokens(text)
        #: The token that is next, "" at the end, and its line.
        self._next, self._line = next(self._tokens, ("", 1))
        self._counts: dict[Path, int] = {}
        self._lines: dict[Path, int] = {}

    def scan(self) -> dict[Path, int]:
        """Return the lines."""
        above: Path = ()
        while self._next:
            if self._next == "\n":
                self._take()
            elif self._next == "[":
                above = self._header()
            else:
                self._pair(above)
        return self._lines

    def _take(self) -> str:
        taken = self._next
        self._next, self._line = next(self._tokens, ("", self._line))
        return taken

    def _note(self, path: Path, line: int) -> None:
        """Note a path, and those before its last part where dots join them."""
        for end in range(1, len(path) + 1):
            self._lines.setdefault(path[:end], line)

    def _header(self) -> Path:
        line = self._line
        self._take()
        is_list = self._next == "["
        if is_list:
            self._take()
        words = self._words()
        while self._next == "]":
            self._take()
        path: Path = ()
        for word in words[:-1]:
            path = self._last((*path, word))
        path = (*path, words[-1])
        if is_list:
            self._counts[path] = self._counts.get(path, -1) + 1
        path = self._last(path)
        self._note(path, line)
        return path

    def _last(self, path: Path) -> Path:
        """Return a path; of a list of tables that of its last table."""
        return (*path, self._counts[path]) if path in self._counts else path

    def _words(self) -> list[str]:
        """Return the parts of a key."""
        words = [_word(self._take())]
        while self._next == ".":
            self._take()
            words.append(_word(self._take()))
        return words

    def _pair(self, above: Path) -> None:
        line = self._line
        path = (*above, *self._words())
        self._note(path, line)
        self._take()
        self._value(path)

    def _value(self, path: Path) -> None:
        """Go over a value; the caller has checked how deeply values are nested."""
        first = self._take()
        if first == "[":
            number = 0
            while self._next not in ("]", ""):
                if self._next in (",", "\n"):
                    number += self._take() == ","
                    continue
                self._note((*path, number), self._line)
                self._value((*path, number))
            self._take()
        elif first == "{":
            while self._next not in ("}", ""):
                if self._next in (",", "\n"):
                    self._take()
                else:
                    self._pair(path)
            self._take()
        else:
            while self._next not in (",", "]", "}", "\n", ""):
                self._take()


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    """Return the tokens but remarks, and their lines."""
    line = 1
    for match in _TOKEN.finditer(text):
        if not match[0].startswith("#"):
            yield match[0], line
        line += match[0].count("\n")


def _word(token: str) -> str:
    if token.startswith('"'):
        word: str = tomllib.loads(f"a = {token}")["a"]
        return word
    return token.strip("'")
