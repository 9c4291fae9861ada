"""Tables and text on standard output."""

from __future__ import annotations

from typing import Final

import click
from rich.console import Console, RenderableType

# Console width for output to a file or another program, where lines must not be wrapped.
_UNBROKEN: Final = 4096


def show(renderable: RenderableType) -> None:
    """Print a rich renderable: wrapped to the terminal's width, or unwrapped without a terminal."""
    console = Console(markup=False, highlight=False, emoji=False)
    if console.is_terminal:
        console.print(renderable)
        return
    console.width = _UNBROKEN
    with console.capture() as captured:
        console.print(renderable)
    # rich pads every cell to the width of its column; strip the padding of the last column.
    for line in captured.get().splitlines():
        click.echo(line.rstrip())
