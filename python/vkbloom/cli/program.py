"""The program: its commands, and the conversion of errors to one line and an exit status."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, NoReturn

import click
from click.core import ParameterSource

import vkbloom
from vkbloom.free_memory import ADVICE, memory_left
from vkbloom.registry import METHODS

#: Names of the modules of this package that have a click command called `command`.
COMMANDS: Final = (
    "render",
    "apply",
    "view",
    "explore",
    "grid",
    "fit",
    "check",
    "compare",
    "adapters",
    "doctor",
    "warm",
)

#: The status after Ctrl-C, as shells report it.
INTERRUPTED: Final = 130

_FAILURES: Final = (vkbloom.Error, OSError, ValueError, ImportError, MemoryError)


# How Python and OpenImageIO report that there is no memory for a thread's stack.
_NO_THREAD: Final = ("start new thread", "Resource temporarily unavailable")


class Program(click.Group):
    """A group that imports a command when it is called, and prints an error as one line.

    A command's return value is the exit status; None is 0.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command; None if there is no such command."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"vkbloom.cli.{cmd_name}").command
        return command

    def main(  # type: ignore[override]
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **options: Any
    ) -> NoReturn:
        """Run the program and exit: 0 done, 1 failed, 2 wrong use, 130 interrupted."""
        options["standalone_mode"] = False
        try:
            words = with_methods(sys.argv[1:] if args is None else args)
            status = super().main(words, prog_name, **options)
        except click.UsageError as error:
            where = f" (see {error.ctx.command_path} --help)" if error.ctx else ""
            _exit(2, error.format_message() + where)
        except click.ClickException as error:
            _exit(1, error.format_message())
        except click.Abort:
            _exit(INTERRUPTED, "interrupted")
        except Exception as error:
            if _is_from_interrupt(error):
                _exit(INTERRUPTED, "interrupted")
            if isinstance(error, RuntimeError) and any(one in str(error) for one in _NO_THREAD):
                _exit(1, _described(MemoryError(str(error))))
            if isinstance(error, _FAILURES):
                _exit(1, _described(error))
            raise
        sys.exit(status)


def with_methods(words: Sequence[str]) -> list[str]:
    """Load the files of own methods after --method; return the words with the methods' names."""
    changed = list(words)
    for place, word in enumerate(changed):
        option, _, value = word.partition("=")
        if option != "--method":
            continue
        joined = bool(value)
        if not joined and place + 1 < len(changed):
            value = changed[place + 1]
        if value in METHODS or not os.path.isfile(value):
            continue
        name = vkbloom.load_method(value).method
        if joined:
            changed[place] = f"--method={name}"
        else:
            changed[place + 1] = name
    return changed


def _is_from_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error, as when it ends a cluster that is starting."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _described(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = str(error) or type(error).__name__
    if isinstance(error, MemoryError) and "memory is short" not in text:
        left = memory_left()
        free = "" if left is None else f" ({left >> 20} MiB are free)"
        return f"memory is short{free}: {text}; {ADVICE}"
    return text


def _exit(status: int, message: str) -> NoReturn:
    click.echo(f"vkbloom: {' '.join(message.split())}", err=True)
    sys.exit(status)


@contextmanager
def as_wrong_use() -> Iterator[None]:
    """Convert a TypeError or ValueError of an argument to click.UsageError, exit status 2."""
    try:
        yield
    except (TypeError, ValueError) as error:
        raise click.UsageError(str(error)) from error


def given(name: str, context: click.Context | None = None) -> bool:
    """Return whether the user set a parameter of the running command, or of another context's."""
    source = (context or click.get_current_context()).get_parameter_source(name)
    return source not in (None, ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)


@click.group(
    cls=Program,
    # A call without a command prints one line instead of the help text.
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(package_name="vkbloom", message="%(prog)s %(version)s")
def program() -> None:
    """Render bloom and inspect each of its framebuffers."""
