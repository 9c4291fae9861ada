"""``vkbloom adapters``: list the Vulkan adapters that vkbloom can use."""

from __future__ import annotations

import dataclasses
import json

import click
from rich import box
from rich.table import Table

import vkbloom
from vkbloom._cli.bare import NO_ADAPTER
from vkbloom._cli.terminal import show


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a list of objects.")
def command(as_json: bool) -> None:
    """List the Vulkan adapters that vkbloom can use."""
    found = vkbloom.adapters()
    if as_json:
        click.echo(json.dumps([dataclasses.asdict(adapter) for adapter in found], indent=2))
    if not found:
        raise click.ClickException(NO_ADAPTER)
    if as_json:
        return
    table = Table(box=box.SIMPLE_HEAD)
    for title in ("name", "type", "driver", "version", "Vulkan", "bundled"):
        table.add_column(title)
    for adapter in found:
        table.add_row(
            adapter.name,
            adapter.type,
            adapter.driver,
            adapter.driver_info,
            adapter.api_version,
            "yes" if adapter.bundled else "no",
        )
    show(table)
