"""``vkbloom doctor``: check whether this machine can render, and explain what prevents it."""

from __future__ import annotations

import json
from typing import Final

import click

import vkbloom
from vkbloom._doctor import examine

_COLOURS: Final = {"ok": "green", "note": "yellow", "problem": "red"}


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print one object with all findings.")
def command(as_json: bool) -> int:
    """Check whether this machine can render, and explain what prevents it.

    Examines the Vulkan loader, its drivers and layers, the adapters, the caches and the optional
    packages. Renders a small test scene on each adapter and checks the result. The exit status is
    1 if no adapter renders it correctly.
    """
    findings, can_render = examine()
    if as_json:
        found = {"version": vkbloom.__version__, "can_render": can_render}
        found["findings"] = [finding._asdict() for finding in findings]
        click.echo(json.dumps(found, indent=2))
    else:
        for finding in findings:
            status = click.style(f"{finding.status:9}", _COLOURS[finding.status])
            click.echo(f"{status}{finding.topic:30}  {finding.found}")
            if finding.advice:
                click.echo(f"{'':41}-> {finding.advice}")
        able = "can render" if can_render else "cannot render"
        problems = sum(finding.status == "problem" for finding in findings)
        click.echo(f"\nThis machine {able}. Problems found: {problems}.")
    return 0 if can_render else 1
