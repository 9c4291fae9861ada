"""Commands that list what has a published name."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any, Final, TypeAlias

import click
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

# Console width for output to a file or another program, where lines must not be wrapped.
_UNBROKEN: Final = 4096


#: What has a published name, as --json prints it: "name"; "what" it looks like; "whose" it is, its
#: source; "composite", how its light comes into the picture; "needs_hdr", whether only values above
#: 1 glow; and further keys.
Entry: TypeAlias = dict[str, Any]


def listing_command(text: str, entries: Callable[[], Iterable[Entry]]) -> Any:
    """Return the command that lists entries, with the help `text`."""

    @click.command(help=text)
    @click.option("--json", "as_json", is_flag=True, help="Print a list of objects.")
    def command(*, as_json: bool) -> None:
        if as_json:
            click.echo(json.dumps(list(entries()), indent=2))
        else:
            _show(_table(entries()))

    return command


def _table(entries: Iterable[Entry]) -> Table:
    """Return a table of one line for each entry; a narrow terminal cuts the last two columns."""
    listed = list(entries)
    is_grouped = any("engine" in item for item in listed)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("name", "composite", "needs HDR", *["confirmed by"] * is_grouped):
        table.add_column(title, no_wrap=True)
    # Columns that rich makes narrower, with texts that it does not wrap.
    table.add_column("what")
    table.add_column("whose")
    engine = ""
    for item in listed:
        if item.get("engine", "") != engine:
            engine = item["engine"]
            table.add_row(Text(f"{engine}:", style="bold"))
        cut = (Text(item[key], no_wrap=True, overflow="ellipsis") for key in ("what", "whose"))
        confirmed = [item["confirmed"]] if is_grouped else []
        hdr = "yes" if item["needs_hdr"] else "no"
        table.add_row(item["name"], item["composite"], hdr, *confirmed, *cut)
    return table


def _show(table: Table) -> None:
    """Print a table: wrapped to the terminal's width, or unwrapped without a terminal."""
    console = Console(markup=False, highlight=False, emoji=False)
    if console.is_terminal:
        console.print(table)
        return
    console.width = _UNBROKEN
    with console.capture() as captured:
        console.print(table)
    # rich pads every cell to the width of its column; strip the padding of the last column.
    for line in captured.get().splitlines():
        click.echo(line.rstrip())
