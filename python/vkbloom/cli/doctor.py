"""``vkbloom doctor``: check whether this machine can render, and explain what prevents it."""

from __future__ import annotations

import dataclasses
import json
from typing import Final

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

import vkbloom
from vkbloom.cli.terminal import is_quiet, show
from vkbloom.doctor import Finding, Report, examine

_STYLES: Final = {"ok": "green", "note": "yellow", "problem": "bold red"}


def _json(report: Report) -> str:
    return json.dumps(
        {
            "version": vkbloom.__version__,
            "can_render": report.can_render,
            "findings": [dataclasses.asdict(finding) for finding in report.findings],
        },
        indent=2,
    )


def _table(findings: tuple[Finding, ...]) -> Table:
    table = Table.grid(padding=(0, 2))
    for _ in range(3):
        table.add_column(overflow="fold")
    for finding in findings:
        table.add_row(Text(finding.status, _STYLES[finding.status]), finding.topic, finding.found)
        if finding.advice:
            table.add_row("", "", f"-> {finding.advice}")
    return table


def _verdict(report: Report) -> str:
    problems = sum(finding.status == "problem" for finding in report.findings)
    able = "can render" if report.can_render else "cannot render"
    return f"This machine {able}. Problems found: {problems}."


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print one object with all findings.")
def command(as_json: bool) -> int:
    """Check whether this machine can render, and explain what prevents it.

    Examines the Vulkan loader, its drivers and layers, the adapters, the pipeline cache and the
    optional packages. Renders a small test scene on each adapter and checks the result. The exit
    status is 1 if no adapter renders it correctly.
    """
    with Console(stderr=True, quiet=is_quiet()).status("Examining this machine"):
        report = examine()
    if as_json:
        click.echo(_json(report))
    else:
        show(_table(report.findings))
        click.echo(f"\n{_verdict(report)}")
    return 0 if report.can_render else 1
