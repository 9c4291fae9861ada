"""``vkbloom describe``: a description of shaders."""

from __future__ import annotations

import click

from vkbloom._cli.fields import Command
from vkbloom._custom.described.generate import describe


@click.command("describe", cls=Command)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
def command(files: tuple[str, ...]) -> None:
    """Print a description of shaders, bloom.toml.

    FILEs are shaders in GLSL, HLSL, Slang, WGSL, WESL or SPIR-V, in the order of the passes. What
    they bind is read from the compiled shaders; TODO marks what only a person can say. Write it
    into a file, complete it, and give that to --method and to check.
    """
    click.echo(describe(files), nl=False)
