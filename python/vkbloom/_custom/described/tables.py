"""The tables of a description, with the line of each key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterator
from typing import Any, Final, NoReturn

from vkbloom._custom.described.lines import Path, find_lines
from vkbloom._custom.source import Source
from vkbloom._spelling import did_you_mean

#: Of a description: characters, and how deeply values are nested.
MAX_CHARACTERS: Final = 1 << 20
MAX_DEPTH: Final = 16
#: Of a value that a message shows.
MAX_SHOWN: Final = 100

#: The names of types in messages.
_KINDS: Final = {
    str: "a text",
    bool: "true or false",
    int: "a whole number",
    dict: "a table",
    list: "a list",
}
_DOTS: Final = re.compile(rf"(?:\.[ \t]*[\w\"'-]{{1,99}}[ \t]*){{{MAX_DEPTH}}}")
_AT_LINE: Final = re.compile(r"(.*) \(at line (\d+), column \d+\)", re.DOTALL)


def read_tables(source: Source) -> Table:
    """Read a description's text; raise ValueError if it is not TOML."""
    text = source.text
    if len(text) > MAX_CHARACTERS:
        raise source.fault(1, f"{len(text)} characters are more than {MAX_CHARACTERS}")
    if match := _DOTS.search(text):
        line = text.count("\n", 0, match.start()) + 1
        raise source.fault(line, f"a key has more than {MAX_DEPTH} parts")
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise source.fault(1, "the file nests its lists too deeply") from None
    except ValueError as error:  # also of a number of too many digits
        match = _AT_LINE.fullmatch(str(error))
        last = text.rstrip().count("\n") + 1
        line = int(match[2]) if match else last
        cause = match[1] if match else str(error).removesuffix(" (at end of document)")
        raise source.fault(line, f"this is not TOML: {cause}") from None
    _check_depth(source, data)
    return Table(source, data, (), find_lines(text))


def _check_depth(source: Source, data: dict[str, Any]) -> None:
    """Check how deeply values are nested, so that recursion ends."""
    waiting: list[tuple[Any, int]] = [(data, 0)]
    for value, depth in waiting:
        if depth > MAX_DEPTH:
            raise source.fault(1, f"values are nested more than {MAX_DEPTH} times")
        inner = value.values() if isinstance(value, dict) else value
        waiting += [(each, depth + 1) for each in inner if isinstance(each, dict | list)]


def shown(value: object) -> str:
    """Return a value as messages show it: the begin of it, if it is long."""
    try:
        text = repr(value)
    except ValueError:  # a number with more digits than Python shows
        return "a number of thousands of digits"
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


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
        for end in range(len(path) - 1, 0, -1):
            if path[:end] in self._lines:
                return self._lines[path[:end]]
        return 1

    def fault(self, cause: str, *keys: str | int) -> ValueError:
        """Return the error of a key."""
        return self.source.fault(self.line(*keys), cause)

    def refuse(self, key: str, value: object, cause: str) -> NoReturn:
        """Raise the error of a key's value."""
        raise self.fault(f"{key}: {shown(value)} {cause}", key)

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
            named = [kind for kind in allowed if kind is not int or float not in allowed]
            names = " or ".join(dict.fromkeys(_KINDS.get(kind, "a number") for kind in named))
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
            self.refuse(key, value, f"is not one of {', '.join(filter(None, words))}{near}")
        return value

    def table(self, key: str) -> Table:
        """Return a table; an empty one where there is none."""
        return Table(self.source, self.get(key, dict, {}), (*self._path, key), self._lines)

    def tables(self, key: str) -> list[Table]:
        """Return the tables of a list."""
        found = self.get(key, list, [])
        for number, each in enumerate(found):
            if not isinstance(each, dict):
                raise self.fault(f"{key}: {shown(each)} is not a table", key, number)
        return [
            Table(self.source, each, (*self._path, key, number), self._lines)
            for number, each in enumerate(found)
        ]

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a list of texts; one text is a list of it."""
        value = self.get(key, (str, list), [])
        found = [value] if isinstance(value, str) else value
        for number, each in enumerate(found):
            if not isinstance(each, str) or not each:
                raise self.fault(f"{key}: {shown(each)} is not a text", key, number)
        return tuple(found)

    def finish(self, what: str, *others: str) -> None:
        """Raise ValueError if a key was not taken; `others` are keys that it could have."""
        known = {*self._taken, *others}
        for key in self._data:
            if key not in self._taken:
                near = did_you_mean(key, known) or f"; known are {', '.join(sorted(known))}"
                raise self.fault(f"{shown(key)} is not a key of {what}{near}", key)
