"""``vkbloom adapters``: list the Vulkan adapters that vkbloom can use."""

from __future__ import annotations

import click

from vkbloom._cli import bare


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a list of objects.")
def command(as_json: bool) -> int:
    """List the Vulkan adapters that vkbloom can use."""
    return bare.list_adapters(as_json=as_json)
