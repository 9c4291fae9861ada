"""What is printed: results, and what --quiet leaves out."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

import click

if TYPE_CHECKING:
    import vkbloom


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
    click.echo(f"vkbloom: {' '.join(text.split())}", err=True)


def note(text: str) -> None:
    """Print a note that is not an error on standard error, unless --quiet."""
    say(f"vkbloom: note: {text}", err=True)


def tell_device(renderer: vkbloom.Renderer, *, err: bool = False) -> None:
    """Print the adapter."""
    say(f"Rendering on {renderer.info.summary}", err=err)
