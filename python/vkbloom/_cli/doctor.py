"""``vkbloom doctor``: check whether this machine can render, and explain what prevents it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from vkbloom._cli import bare
from vkbloom._cli.program import adapter_option
from vkbloom._cli.targets import check_target
from vkbloom._cli.terminal import Form, hides_progress, json_option, say
from vkbloom._doctor import self_test
from vkbloom._renderer.adapter import AdapterInfo


@click.command()
@click.option(
    "--self-test", "compares", is_flag=True, help="Compare this device with the reference instead."
)
@adapter_option
@click.option(
    "--json",
    "as_json",
    is_flag=False,
    flag_value="-",
    metavar="[FILE]",
    help="Print one object with all findings, or write it to FILE and print the table.",
)
def command(compares: bool, adapter: str, as_json: str | None) -> int:
    """Check whether this machine can render, and explain what prevents it.

    Examines the Vulkan loader, its drivers and layers, the adapters, the caches and the optional
    packages. Renders a small test scene on each adapter and checks the result. The exit status is
    1 if no adapter renders it correctly.

    With --self-test, it renders with every method, format and kind of derivative on one adapter.
    The exit status is 1 if a value is farther from the reference than the documentation allows.
    """
    if as_json not in (None, "-"):
        check_target(as_json)
    result = _compare(adapter) if compares else bare.examine()
    text = json.dumps(result, indent=2)
    if as_json == "-":
        click.echo(text)
    elif compares:
        _show_groups(result)
    else:
        click.echo("\n".join(bare.lines_of(result)))
    if as_json not in (None, "-"):
        Path(as_json).write_text(f"{text}\n", encoding="utf-8")
        say(f"wrote {as_json}")
    return 0 if result["passed" if compares else "can_render"] else 1


def _compare(adapter: str) -> dict[str, Any]:
    start, results = time.perf_counter(), []
    with tqdm(unit="case", leave=False, disable=hides_progress()) as bar:
        for item in self_test.run(adapter):
            results.append(item)
            bar.total = item.get("count", bar.total)
            bar.update("group" in item)
    return self_test.report(adapter, results, time.perf_counter() - start)


def _show_groups(report: dict[str, Any]) -> None:
    if report["device"]:
        click.echo(AdapterInfo(**report["device"]).summary)
    click.echo(f"\n{'group':18}{'cases':>6}{'wrong':>6}{'error':>10}{'allowed':>10}{'seconds':>9}")
    for group in report["groups"]:
        error, allowed = (
            "" if group[name] is None else f"{group[name]:.2g}"
            for name in ("largest_error", "allowed")
        )
        line = f"{group['name']:18}{group['cases']:6}{group['wrong']:6}{error:>10}{allowed:>10}"
        click.secho(f"{line}{group['seconds']:9.1f}", fg="red" if group["wrong"] else None)
    for item in report["wrong"]:
        click.echo(f"\nwrong: {item['group']}: {item['name']}\n       {item['wrong']}")
    click.echo(
        f"\n{report['cases']} cases in {report['seconds']:.0f} s, wrong: {len(report['wrong'])}."
    )


@click.command()
@json_option("Print a list of objects.")
def adapters(form: Form) -> int:
    """List the Vulkan adapters that vkbloom can use."""
    return bare.list_adapters(form)
