"""Commands whose options may stand in a TOML or YAML file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import click

from vkbloom.extras import import_extra

__all__ = ["FILE_OPTION", "CommandWithFile"]

FILE_OPTION: Final = "--from"

# Tables of options and what they stand for: their names are those of options as well, or of axes.
_PLAIN_TABLES: Final = ("settings", "camera")
_NAMED_TABLES: Final = {"axes": "--axis", "reduce": "--reduce", "chunks": "--chunk"}
_ARGUMENTS: Final = "images"
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
                found = [*_words(_read(Path(path)), path), *found]
        return super().parse_args(ctx, found)


def _read(path: Path) -> dict[str, Any]:
    """Return what a file holds.

    Raises
    ------
    OSError, ValueError
        It cannot be read; names the file.
    """
    text = path.read_text(encoding="utf-8")
    content: object
    if path.suffix.lower() == ".toml":
        try:
            content = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"{path}: {error}") from error
    elif path.suffix.lower() in (".yaml", ".yml"):
        yaml = import_extra("yaml", "cli", "Reading YAML")
        try:
            content = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ValueError(f"{path}: {error}") from error
    else:
        raise ValueError(f"{path}: its extension is none of .toml, .yaml, .yml")
    if not isinstance(content, dict):
        raise ValueError(f"{path}: names and values are needed")
    return content


def _words(content: Mapping[str, Any], path: str) -> list[str]:
    """Return what would stand on the command line."""
    words: list[str] = []
    arguments: list[str] = []
    for key, value in content.items():
        if key in _NAMED_TABLES:
            for name, inner in _table(value, key, path).items():
                words += [_NAMED_TABLES[key], f"{name}={_values(name, inner)}"]
        elif key in _PLAIN_TABLES:
            prefix = "camera-" if key == "camera" else ""
            for name, inner in _table(value, key, path).items():
                words += _option(f"{prefix}{name}", inner)
        elif key == _ARGUMENTS:
            arguments += [value] if isinstance(value, str) else [str(part) for part in value]
        else:
            words += _option(str(key), value)
    return [*words, *arguments]


def _table(value: object, key: str, path: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{path}: {key} must be a table")
    return value


def _option(name: str, value: Any) -> list[str]:
    option = name.replace("_", "-")
    if isinstance(value, bool):
        return [f"--{option}" if value else f"--no-{option}"]
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
