"""Commands that also take their options from a TOML or YAML file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import click

from vkbloom.checks import import_extra
from vkbloom.cli.fields import Command

__all__ = ["FILE_OPTION", "CommandWithFile"]

FILE_OPTION: Final = "--from"

# Tables whose keys are options, and tables whose keys are the names in a repeated option.
_PLAIN_TABLES: Final = ("settings", "camera")
_NAMED_TABLES: Final = {"axes": "--axis", "reduce": "--reduce", "chunks": "--chunk"}
_ARGUMENTS: Final = "images"
# Limits of a file's values: nesting of lists, and length when written as options.
_MOST_DEPTH: Final = 64
_MOST_LETTERS: Final = 1 << 22
_MOST_BITS: Final = 64
_TOO_MUCH: Final = "its values are too many, nested too deeply, or contain themselves"
# Options that are written as WIDTHxHEIGHT.
_SIZES: Final = ("size", "bloom-size")


class CommandWithFile(Command):
    """A command that reads options from a file; options on the command line override them.

    The file's keys are the long options without the leading dashes, written with ``-`` or ``_``.
    The tables ``settings`` and ``camera`` contain options; ``axes``, ``reduce`` and ``chunks``
    contain the values of repeated options; the list ``images`` contains the arguments.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the file, if one is given, and parse its options before the others."""
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
                # The file's options come first, because later options override earlier ones.
                found = [*_words(_read(Path(path)), path, self._flags(ctx)), *found]
        return super().parse_args(ctx, found)

    def _flags(self, ctx: click.Context) -> dict[str, bool]:
        """Return the flags by name, and whether each has a ``--no-`` form."""
        options = (one for one in self.get_params(ctx) if isinstance(one, click.Option))
        flags = [one for one in options if one.is_flag]
        return {name: bool(flag.secondary_opts) for flag in flags for name in flag.opts}


def _read(path: Path) -> dict[str, Any]:
    """Read and check an option file."""
    suffix = path.suffix.lower()
    if suffix not in (".toml", ".yaml", ".yml"):
        raise ValueError(f"{path}: its extension is not .toml, .yaml or .yml")
    content = path.read_bytes()
    try:
        found = _toml(content) if suffix == ".toml" else _yaml(content)
        _check_size(found, {})
    except RecursionError:
        raise ValueError(f"{path}: {_TOO_MUCH}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if not isinstance(found, dict):
        raise ValueError(f"{path}: its content is not a mapping of option names to values")
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
        # An example is "!!bool 3".
        raise ValueError(f"a value does not fit its tag ({error})") from error


def _check_size(value: object, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """Return an estimate of a value's length as options, and the depth of its nesting.

    A YAML alias refers to a value without copying it; each value is measured once here, before
    writing it out could multiply it.
    """
    if isinstance(value, str | bytes):
        return len(value), 0
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        raise ValueError(f"it contains an integer of more than {_MOST_BITS} bits")
    if not isinstance(value, dict | list | tuple | set):
        return 1, 0
    if id(value) not in known:
        # A value that contains itself finds this entry, whose depth exceeds the limit.
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
    """Return a file's content as words of a command line."""
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
                raise ValueError(f"{path}: {key} is not a list")
            arguments += [str(part) for part in listed]
        elif f"--{key}" == FILE_OPTION:
            raise ValueError(f"{path}: {key} cannot be used inside a file")
        else:
            words += _option(_named(key, "", path), value, path, flags)
    return [*words, *arguments]


def _table(value: object, key: str, path: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{path}: {key} is not a table")
    return value


def _named(key: object, prefix: str, path: str) -> str:
    # Any other name would be parsed as a value, or as the end of the options.
    if not re.fullmatch(r"[\w-]+", str(key)):
        raise ValueError(f"{path}: {key!r} is not the name of an option")
    return f"{prefix}{key}"


def _option(name: str, value: Any, path: str, flags: Mapping[str, bool]) -> list[str]:
    option = name.replace("_", "-")
    is_flag = f"--{option}" in flags
    if value is False and is_flag and not flags[f"--{option}"]:
        return []
    if isinstance(value, bool):
        return [f"--{option}" if value else f"--no-{option}"]
    if is_flag:
        # A word after a flag would be parsed as an image.
        raise ValueError(f"{path}: {name}: {value!r} is not true or false")
    return [f"--{option}", _spelled(value, "x" if option in _SIZES else ",:")]


def _values(name: str, value: Any) -> str:
    """Write the values of an axis; values that contain commas are separated by semicolons."""
    if not isinstance(value, list) or not any(isinstance(part, list) for part in value):
        return _spelled(value, ",")
    inner = "x" if name.replace("_", "-") in _SIZES else ",:"
    return "".join(_spelled(part, inner) + ";" for part in value)


def _spelled(value: Any, separators: str) -> str:
    """Write a value in the syntax of the command line; each list level has its own separator."""
    if isinstance(value, list):
        return separators[:1].join(_spelled(part, separators[1:]) for part in value)
    if isinstance(value, dict):
        return ",".join(f"{key}={_spelled(inner, separators)}" for key, inner in value.items())
    if isinstance(value, bool):
        return "on" if value else "off"
    return "none" if value is None else str(value)
