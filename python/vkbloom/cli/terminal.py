"""Tables and sentences on standard output."""

from __future__ import annotations

from typing import Final

import click
from rich.console import Console, RenderableType

# Of output that goes to a file or another program, where lines are not to be broken.
_UNBROKEN: Final = 4096


def show(renderable: RenderableType) -> None:
    """Print what rich can render: as wide as the terminal, or unbroken where there is none.

    Parameters
    ----------
    renderable
        Text is printed as it is, without rich's markup.
    """
    console = Console(markup=False, highlight=False, emoji=False)
    if console.is_terminal:
        console.print(renderable)
        return
    console.width = _UNBROKEN
    with console.capture() as captured:
        console.print(renderable)
    # Cells are filled with blanks to the width of their column, also in the last one.
    for line in captured.get().splitlines():
        click.echo(line.rstrip())
