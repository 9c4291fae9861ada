"""What is printed: results, and what --quiet leaves out or --verbose adds."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import click

if TYPE_CHECKING:
    import vkbloom

_QUIET, _USUAL, _VERBOSE = range(3)


class _Printing:
    """How much the running command prints; other threads print as well."""

    level = _USUAL


def _set_level(level: int) -> Callable[[click.Context, click.Parameter, bool], None]:
    def callback(_: click.Context, __: click.Parameter, given: bool) -> None:
        if given:
            _Printing.level = level

    return callback


#: ``--quiet`` and ``--verbose``, of the program and of every command.
PRINTING_OPTIONS: Final = (
    click.Option(
        ["-q", "--quiet"],
        is_flag=True,
        expose_value=False,
        callback=_set_level(_QUIET),
        help="Print results and errors only: no progress, no notes, no names of written files.",
    ),
    click.Option(
        ["-v", "--verbose"],
        is_flag=True,
        expose_value=False,
        callback=_set_level(_VERBOSE),
        help="Also print the adapter, the sizes and the times, on standard error.",
    ),
)


def print_as_usual() -> None:
    """Forget --quiet and --verbose of an earlier call in this process."""
    _Printing.level = _USUAL


def is_quiet() -> bool:
    """Return whether progress and notes are left out."""
    return _Printing.level == _QUIET


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


def detail(text: str) -> None:
    """Print a line on standard error if there is --verbose."""
    if _Printing.level == _VERBOSE:
        click.echo(f"vkbloom: {text}", err=True)


def tell_device(renderer: vkbloom.Renderer, *, err: bool = False) -> None:
    """Print the adapter; in detail if there is --verbose."""
    say(f"Rendering on {renderer.info.summary}", err=err)
    detail_device(renderer)


def detail_device(renderer: vkbloom.Renderer) -> None:
    """Print the adapter, its driver and its version of Vulkan if there is --verbose."""
    info = renderer.info
    driver = " ".join(filter(None, (info.driver, info.driver_info)))
    detail(f"adapter: {info.name} ({info.type}), {driver}, Vulkan {info.api_version}")
