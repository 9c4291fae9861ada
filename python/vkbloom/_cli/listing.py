"""Commands that list what has a published name."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable
from typing import Any, Final

import click
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

# Console width for output to a file or another program, where lines must not be wrapped.
_UNBROKEN: Final = 4096


@dataclasses.dataclass(frozen=True)
class Entry:
    """What has a published name.

    - `what`: What it looks like.
    - `whose`: Its source.
    - `composite`: How its light comes into the picture: "add", "mix", ...
    - `needs_hdr`: Whether only values above 1 glow.
    - `values`: Further keys of the JSON.
    """

    name: str
    what: str
    whose: str
    composite: str
    needs_hdr: bool
    values: dict[str, Any] = dataclasses.field(default_factory=dict)


def listing_command(text: str, entries: Callable[[], Iterable[Entry]]) -> Any:
    """Return the command that lists entries, with the help `text`."""

    @click.command(help=text)
    @click.option("--json", "as_json", is_flag=True, help="Print a list of objects.")
    def command(*, as_json: bool) -> None:
        listed = list(entries())
        if as_json:
            objects = [
                {key: value for key, value in dataclasses.asdict(entry).items() if key != "values"}
                | entry.values
                for entry in listed
            ]
            click.echo(json.dumps(objects, indent=2))
        else:
            _show(_table(listed))

    return command


def _table(entries: Iterable[Entry]) -> Table:
    """Return a table of one line for each entry; a narrow terminal cuts the last two columns."""
    listed = list(entries)
    is_grouped = any("engine" in item.values for item in listed)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("name", "composite", "needs HDR", *["confirmed by"] * is_grouped):
        table.add_column(title, no_wrap=True)
    # Columns that rich makes narrower, with texts that it does not wrap.
    table.add_column("what")
    table.add_column("whose")
    engine = ""
    for item in listed:
        if item.values.get("engine", "") != engine:
            engine = item.values["engine"]
            table.add_row(Text(f"{engine}:", style="bold"))
        texts = (Text(text, no_wrap=True, overflow="ellipsis") for text in (item.what, item.whose))
        confirmed = [item.values["confirmed"]] if is_grouped else []
        hdr = "yes" if item.needs_hdr else "no"
        table.add_row(item.name, item.composite, hdr, *confirmed, *texts)
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
