"""What is printed: results, and what --quiet leaves out."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, TypeVar

import click

if TYPE_CHECKING:
    from vkbloom._renderer.renderer import Renderer


#: The most characters of an error or a note. Names in files may have any length.
MAX_MESSAGE: Final = 2000
# Of these, the end, which has the reason where the beginning has a name.
_END: Final = 600


#: How a command prints its results.
Form: TypeAlias = Literal["text", "json"]
_Command = TypeVar("_Command", bound=Callable[..., Any])


class _Printing:
    """How much the running command prints; other threads print as well."""

    is_quiet = False


def _set_quiet(_: click.Context, __: click.Parameter, given: bool) -> None:
    _Printing.is_quiet = _Printing.is_quiet or given


#: ``--quiet``, of the program and of every command.
QUIET_OPTION: Final = click.Option(
    ["-q", "--quiet"],
    is_flag=True,
    expose_value=False,
    callback=_set_quiet,
    help="Print results and errors only: no progress, no notes, no names of written files.",
)


def json_option(help: str) -> Callable[[_Command], _Command]:
    """Return the decorator that adds ``--json`` to a command, which gets its `form`."""
    return click.option(
        "--json",
        "form",
        is_flag=True,
        callback=lambda _, __, given: "json" if given else "text",
        help=help,
    )


def print_as_usual() -> None:
    """Forget --quiet of an earlier call in this process."""
    _Printing.is_quiet = False


def is_quiet() -> bool:
    """Return whether progress and notes are left out."""
    return _Printing.is_quiet


def hides_progress() -> bool | None:
    """Return the argument `disable` of a tqdm; None: shown where standard error is a terminal."""
    return True if is_quiet() or sys.stderr is None else None


def say(text: str, *, err: bool = False) -> None:
    """Print a line about what is done, unless --quiet."""
    if not is_quiet():
        click.echo(text, err=err)


def complain(text: str) -> None:
    """Print an error as one line on standard error."""
    click.echo(f"vkbloom: {in_line(text)}", err=True)


def in_line(text: str) -> str:
    """Return a text of any contents as one line of at most `MAX_MESSAGE` characters.

    What is not printable, such as a terminal's control sequences in names of files, is escaped.
    """
    line = " ".join(text.split())
    if len(line) > MAX_MESSAGE:
        left_out = f" ... ({len(line)} characters) ... "
        line = line[: MAX_MESSAGE - _END - len(left_out)] + left_out + line[-_END:]
    if line.isprintable():
        return line
    return "".join(
        # Bytes of file names that are no text are printed as they are.
        char if char.isprintable() or "\udc80" <= char <= "\udcff" else ascii(char)[1:-1]
        for char in line
    )


def note(text: str) -> None:
    """Print a note that is not an error on standard error, unless --quiet."""
    say(f"vkbloom: note: {in_line(text)}", err=True)


def tell_device(renderer: Renderer, *, err: bool = False) -> None:
    """Print the adapter."""
    say(f"Rendering on {renderer.info.summary}", err=err)
