"""The program: its commands, and the conversion of errors to one line and an exit status."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, NoReturn

import click
from click.core import ParameterSource

import vkbloom

#: Names of the modules of this package that have a click command called `command`.
COMMANDS: Final = (
    "render",
    "apply",
    "view",
    "explore",
    "grid",
    "fit",
    "compare",
    "adapters",
    "doctor",
)

#: The status after Ctrl-C, as shells report it.
INTERRUPTED: Final = 130

_FAILURES: Final = (vkbloom.Error, OSError, ValueError, ImportError, MemoryError)


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
            status = super().main(args, prog_name, **options)
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
            if isinstance(error, _FAILURES):
                _exit(1, _described(error))
            raise
        sys.exit(status)


def _is_from_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error, as when it ends a cluster that is starting."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _described(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error) or type(error).__name__


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
