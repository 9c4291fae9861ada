"""The tables of a description, with the line of each key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterator, Sequence
from typing import Any, Final, NoReturn

from vkbloom._custom.source import Source
from vkbloom._spelling import did_you_mean

Path = tuple[str | int, ...]

#: The names of types in messages.
_KINDS: Final = {
    str: "a text",
    bool: "true or false",
    int: "a whole number",
    dict: "a table",
    list: "a list",
}
_HEADER: Final = re.compile(r"\s*(\[\[?)\s*(.+?)\s*\]\]?\s*(#.*)?")
_KEY: Final = re.compile(
    r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*="""
)
_WORD: Final = re.compile(r"""[\w-]+|"[^"]*"|'[^']*'""")
_AT_LINE: Final = re.compile(r"(.*) \(at line (\d+), column \d+\)", re.DOTALL)


def read_tables(source: Source) -> Table:
    """Read a description's text; raise ValueError if it is not TOML."""
    try:
        data = tomllib.loads(source.text)
    except tomllib.TOMLDecodeError as error:
        match = _AT_LINE.fullmatch(str(error))
        last = source.text.rstrip().count("\n") + 1
        line = int(match[2]) if match else last
        cause = match[1] if match else str(error).removesuffix(" (at end of document)")
        raise source.fault(line, f"this is not TOML: {cause}") from None
    except RecursionError:
        raise source.fault(1, "the file nests its lists too deeply") from None
    return Table(source, data, (), find_lines(source.text))


def find_lines(text: str) -> dict[Path, int]:
    """Return the lines of headers and of keys that begin a line."""
    lines: dict[Path, int] = {}
    above: Path = ()
    counts: dict[Path, int] = {}
    quoted = ""
    for number, line in enumerate(text.split("\n"), 1):
        if quoted:
            quoted = "" if quoted in line else quoted
            continue
        if header := _HEADER.fullmatch(line):
            above = _with_numbers(_words(header[2]), counts, is_list=header[1] == "[[")
            lines.setdefault(above, number)
        elif key := _KEY.match(line):
            lines.setdefault((*above, *_words(key[1])), number)
            rest = line[key.end() :]
            quoted = next((mark for mark in ('"""', "'''") if rest.count(mark) == 1), "")
    return lines


def _words(text: str) -> list[str]:
    return [word.strip("\"'") for word in _WORD.findall(text)]


def _with_numbers(words: Sequence[str], counts: dict[Path, int], *, is_list: bool) -> Path:
    """Return the path of a header, with the number of each table of a list."""
    path: Path = ()
    for index, word in enumerate(words):
        path = (*path, word)
        if index == len(words) - 1 and is_list:
            counts[path] = counts.get(path, -1) + 1
            for other in [other for other in counts if len(other) > len(path)]:
                if other[: len(path)] == path:
                    del counts[other]
        if path in counts:
            path = (*path, counts[path])
    return path


class Table:
    """A table: its values, each taken once and checked, so that the rest are unknown keys."""

    def __init__(
        self, source: Source, data: dict[str, Any], path: Path, lines: dict[Path, int]
    ) -> None:
        self.source = source
        self._data = data
        self._path = path
        self._lines = lines
        self._taken: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def line(self, *keys: str | int) -> int:
        """Return the line of a key, or the nearest one that is known."""
        path = (*self._path, *keys)
        if path in self._lines:
            return self._lines[path]
        for end in range(len(path) - 1, -1, -1):
            if path[:end] in self._lines:
                return self._search(self._lines[path[:end]], path[end:])
        return 1

    def _search(self, line: int, keys: Path) -> int:
        """Return the line, of those of one value, that has the first of its keys."""
        lines = self.source.text.split("\n")
        later = [other for other in self._lines.values() if other > line]
        end = min(later, default=len(lines) + 1)
        for key in keys:
            if isinstance(key, str):
                for number in range(line, end):
                    if re.search(rf"(?<![\w-]){re.escape(key)}[\"']?\s*=", lines[number - 1]):
                        line = number
                        break
        return line

    def fault(self, cause: str, *keys: str | int) -> ValueError:
        """Return the error of a key."""
        return self.source.fault(self.line(*keys), cause)

    def refuse(self, key: str, value: object, cause: str) -> NoReturn:
        """Raise the error of a key's value."""
        raise self.fault(f"{key}: {value!r} {cause}", key)

    def get(self, key: str, kinds: type | tuple[type, ...], default: Any = None) -> Any:
        """Return a value of one of some types; the default where there is none."""
        self._taken.add(key)
        if key not in self._data:
            return default
        value = self._data[key]
        allowed = kinds if isinstance(kinds, tuple) else (kinds,)
        if not isinstance(value, allowed) or (
            type(value) is bool and not {bool, object} & {*allowed}
        ):
            names = " or ".join(dict.fromkeys(_KINDS.get(kind, "a number") for kind in allowed))
            self.refuse(key, value, f"is not {names}")
        return value

    def text(self, key: str, default: str | None = None) -> str | None:
        """Return a text that is not empty."""
        value: str | None = self.get(key, str, default)
        if value == "":
            self.refuse(key, value, "is empty")
        return value

    def choice(self, key: str, words: Collection[str], default: str) -> str:
        """Return one of some words."""
        value: str = self.get(key, str, default)
        if value not in words:
            near = did_you_mean(value, words)
            self.refuse(key, value, f"is not one of {', '.join(words)}{near}")
        return value

    def table(self, key: str) -> Table:
        """Return a table; an empty one where there is none."""
        return Table(self.source, self.get(key, dict, {}), (*self._path, key), self._lines)

    def tables(self, key: str) -> list[Table]:
        """Return the tables of a list."""
        found = self.get(key, list, [])
        for number, each in enumerate(found):
            if not isinstance(each, dict):
                raise self.fault(f"{key}: {each!r} is not a table", key, number)
        return [
            Table(self.source, each, (*self._path, key, number), self._lines)
            for number, each in enumerate(found)
        ]

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a list of texts; one text is a list of it."""
        value = self.get(key, (str, list), [])
        found = [value] if isinstance(value, str) else value
        for each in found:
            if not isinstance(each, str) or not each:
                self.refuse(key, each, "is not a text")
        return tuple(found)

    def finish(self, what: str) -> None:
        """Raise ValueError if a key was not taken."""
        for key in self._data:
            if key not in self._taken:
                near = (
                    did_you_mean(key, self._taken)
                    or f"; known are {', '.join(sorted(self._taken))}"
                )
                raise self.fault(f"{key!r} is not a key of {what}{near}", key)
