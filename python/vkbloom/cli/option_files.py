"""Commands whose options may stand in a TOML or YAML file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import click

from vkbloom.checks import import_extra

__all__ = ["FILE_OPTION", "CommandWithFile"]

FILE_OPTION: Final = "--from"

# Tables of options and what they stand for: their names are those of options as well, or of axes.
_PLAIN_TABLES: Final = ("settings", "camera")
_NAMED_TABLES: Final = {"axes": "--axis", "reduce": "--reduce", "chunks": "--chunk"}
_ARGUMENTS: Final = "images"
# Of a file's values: lists within lists, and letters.
_MOST_DEPTH: Final = 64
_MOST_LETTERS: Final = 1 << 22
_MOST_BITS: Final = 64
_TOO_MUCH: Final = "its values are too many, or hold each other"
# Written as WIDTHxHEIGHT.
_SIZES: Final = ("size", "bloom-size")


class CommandWithFile(click.Command):
    """A command that takes the options in a file before those of the command line.

    The file's keys are the long options without their dashes, with ``-`` or ``_`` in them. Tables
    group them: ``settings`` and ``camera`` hold options, ``axes``, ``reduce`` and ``chunks`` those
    that are given several times, and the list ``images`` the arguments.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the file, if one is given, and go on with its options."""
        found: list[str] = []
        rest = iter(args)
        for word in rest:
            name, sign, value = word.partition("=")
            if word == "--":
                found += [word, *rest]
            elif name != FILE_OPTION:
                found.append(word)
            else:
                path = value if sign else next(rest, None)
                if path is None:
                    raise click.UsageError(f"{FILE_OPTION} needs the name of a file", ctx)
                # Before the others, which so replace them.
                found = [*_words(_read(Path(path)), path, self._flags()), *found]
        return super().parse_args(ctx, found)

    def _flags(self) -> dict[str, bool]:
        """Return the flags by name, and whether there is another one that turns it off."""
        flags = (one for one in self.params if isinstance(one, click.Option) and one.is_flag)
        return {name: bool(flag.secondary_opts) for flag in flags for name in flag.opts}


def _read(path: Path) -> dict[str, Any]:
    """Return what a file holds.

    Raises
    ------
    OSError, ValueError
        It cannot be read; names the file.
    """
    suffix = path.suffix.lower()
    if suffix not in (".toml", ".yaml", ".yml"):
        raise ValueError(f"{path}: its extension is none of .toml, .yaml, .yml")
    content = path.read_bytes()
    try:
        found = _toml(content) if suffix == ".toml" else _yaml(content)
        _check_size(found, {})
    except RecursionError:
        raise ValueError(f"{path}: {_TOO_MUCH}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if not isinstance(found, dict):
        raise ValueError(f"{path}: names and values are needed")
    return found


def _toml(content: bytes) -> object:
    return tomllib.loads(content.decode())


def _yaml(content: bytes) -> object:
    yaml = import_extra("yaml", "cli", "Reading YAML")
    try:
        return yaml.safe_load(content.decode())
    except yaml.YAMLError as error:
        raise ValueError(str(error)) from error
    except (LookupError, AttributeError, TypeError) as error:
        # Such as "!!bool 3".
        raise ValueError(f"a value does not fit its tag ({error})") from error


def _check_size(value: object, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """Return about as many letters as a value takes when it is spelled, and its lists in lists.

    What a YAML file names several times is there once until then, and is looked at once here.

    Raises
    ------
    ValueError
        Either is too much, or a number has too many digits to be spelled.
    """
    if isinstance(value, str | bytes):
        return len(value), 0
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        raise ValueError(f"a whole number of over {_MOST_BITS} bits is in it")
    if not isinstance(value, dict | list | tuple | set):
        return 1, 0
    if id(value) not in known:
        # What holds itself is met again before it is known.
        known[id(value)] = 0, _MOST_DEPTH
        inner = [*value, *value.values()] if isinstance(value, dict) else value
        found = [_check_size(part, known) for part in inner]
        letters = 1 + sum(1 + letters for letters, _ in found)
        depth = 1 + max((depth for _, depth in found), default=0)
        if letters > _MOST_LETTERS or depth > _MOST_DEPTH:
            raise ValueError(_TOO_MUCH)
        known[id(value)] = letters, depth
    return known[id(value)]


def _words(content: Mapping[str, Any], path: str, flags: Mapping[str, bool]) -> list[str]:
    """Return what would stand on the command line."""
    words: list[str] = []
    arguments: list[str] = []
    for key, value in content.items():
        if key in _NAMED_TABLES:
            for name, inner in _table(value, key, path).items():
                words += [_NAMED_TABLES[key], f"{name}={_values(str(name), inner)}"]
        elif key in _PLAIN_TABLES:
            prefix = "camera-" if key == "camera" else ""
            for name, inner in _table(value, key, path).items():
                words += _option(_named(name, prefix, path), inner, path, flags)
        elif key == _ARGUMENTS:
            listed = [value] if isinstance(value, str) else value
            if not isinstance(listed, list):
                raise ValueError(f"{path}: {key} must be a list")
            arguments += [str(part) for part in listed]
        elif f"--{key}" == FILE_OPTION:
            raise ValueError(f"{path}: {key} cannot stand in a file")
        else:
            words += _option(_named(key, "", path), value, path, flags)
    return [*words, *arguments]


def _table(value: object, key: str, path: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{path}: {key} must be a table")
    return value


def _named(key: object, prefix: str, path: str) -> str:
    # Others would be taken for a value, or for the end of the options.
    if not re.fullmatch(r"[\w-]+", str(key)):
        raise ValueError(f"{path}: {key!r} cannot name an option")
    return f"{prefix}{key}"


def _option(name: str, value: Any, path: str, flags: Mapping[str, bool]) -> list[str]:
    option = name.replace("_", "-")
    is_flag = f"--{option}" in flags
    if value is False and is_flag and not flags[f"--{option}"]:
        return []
    if isinstance(value, bool):
        return [f"--{option}" if value else f"--no-{option}"]
    if is_flag:
        # What follows a flag is taken for an image.
        raise ValueError(f"{path}: {name} must be true or false, not {value!r}")
    return [f"--{option}", _spelled(value, "x" if option in _SIZES else ",:")]


def _values(name: str, value: Any) -> str:
    """Spell the values of an axis; those that hold commas are parted by semicolons."""
    if not isinstance(value, list) or not any(isinstance(part, list) for part in value):
        return _spelled(value, ",")
    inner = "x" if name.replace("_", "-") in _SIZES else ",:"
    return "".join(_spelled(part, inner) + ";" for part in value)


def _spelled(value: Any, separators: str) -> str:
    """Spell a value as it would be on the command line, lists in lists with further separators."""
    if isinstance(value, list):
        return separators[:1].join(_spelled(part, separators[1:]) for part in value)
    if isinstance(value, dict):
        return ",".join(f"{key}={_spelled(inner, separators)}" for key, inner in value.items())
    if isinstance(value, bool):
        return "on" if value else "off"
    return "none" if value is None else str(value)
