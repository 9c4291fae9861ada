"""``python -m benchmarks``: measure the speed of vkbloom and of its peers on this machine."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from benchmarks import BENCHMARKS, Plan, run, write
from benchmarks.page import PAGE, fill, keep, read_results
from benchmarks.plan import usable_cores
from benchmarks.writing import read_earlier
from vkbloom._cli.program import adapter_option, as_wrong_use


def _print_ids(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        for name, row in BENCHMARKS.items():
            click.echo(f"{name:<15} {row.what}")
        context.exit()


def _write_page(context: click.Context, option: click.Parameter, given: Any) -> None:
    """Keep the reports of --keep, write the page of the documentation from all results, exit."""
    if not given or context.resilient_parsing:
        return
    try:
        for name in () if given is True else given:
            click.echo(f"wrote {keep(Path(name))}")
    except ValueError as error:
        raise click.BadParameter(str(error), context, option) from error
    PAGE.write_text(fill(PAGE.read_text(encoding="utf-8"), read_results()), encoding="utf-8")
    click.echo(f"wrote {PAGE}")
    context.exit()


@click.command()
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_ids,
    help="List the benchmarks and exit.",
)
@click.option(
    "--page",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_write_page,
    help="Write the tables of docs/performance.md from the results that are kept, and exit.",
)
@click.option(
    "--keep",
    metavar="FILE.json",
    multiple=True,
    is_eager=True,
    expose_value=False,
    callback=_write_page,
    type=click.Path(exists=True, dir_okay=False),
    help="Keep an earlier result in benchmarks/results, write docs/performance.md, and exit.",
)
@click.option(
    "--only",
    type=click.Choice(list(BENCHMARKS)),
    multiple=True,
    help="Run this benchmark; may be given several times.  [default: all]",
)
@click.option(
    "-o",
    "--out",
    metavar="FILE.md",
    default="bench.md",
    show_default=True,
    type=click.Path(dir_okay=False),
    help="The table. FILE.json is written beside it.",
)
@click.option(
    "--beside",
    metavar="FILE.json",
    multiple=True,
    type=click.Path(exists=True, dir_okay=False),
    help="An earlier result, as with another driver: its ratios stand beside the new ones.",
)
@click.option(
    "--quick", is_flag=True, help="Small images, few rounds: a check only, the times mean nothing."
)
@click.option("--rounds", type=int, help="Rounds for each contender, 3 or more.")
@click.option(
    "--seconds",
    type=float,
    default=Plan.seconds,
    show_default=True,
    help="A group of contenders begins no more rounds after so many seconds.",
)
@click.option(
    "--requests",
    type=int,
    default=Plan.requests,
    show_default=True,
    help="Number of requests in the benchmark requests.",
)
@click.option(
    "--threads",
    type=int,
    help="Threads of the peers.  [default: the cores that this process may use]",
)
@adapter_option
def command(
    *,
    only: tuple[str, ...],
    out: str,
    beside: tuple[str, ...],
    quick: bool,
    rounds: int | None,
    seconds: float,
    requests: int,
    threads: int | None,
    adapter: str,
) -> None:
    """Time vkbloom beside its peers and write a table.

    Peers are OpenCV, SciPy, ducc0, scikit-image, PyTorch, CuPy, VkFFT, CV-CUDA and pygfx. A peer
    that is not installed is listed as missing. Pictures are compared before they are timed.
    Contenders take turns: A B A B. All benchmarks together take half an hour on two cores. Run
    nothing else meanwhile.

    The exit status is 1 if pictures differ that should be equal. Their times are left out.
    """
    target = Path(out)
    if target.suffix != ".md":
        raise click.UsageError(f"--out: {out!r} does not end in .md")
    try:
        earlier = [read_earlier(Path(name)) for name in beside]
    except ValueError as error:
        raise click.UsageError(f"--beside: {error}") from error
    # Fail now rather than after a quarter of an hour.
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=target.parent):
        pass
    with Console(stderr=True).status("") as status:
        with as_wrong_use():
            plan = Plan(
                adapter=adapter,
                quick=quick,
                rounds=rounds,
                seconds=seconds,
                requests=requests,
                threads=usable_cores() if threads is None else threads,
                only=tuple(dict.fromkeys(only)),
                tell=lambda text: status.update(f"Timing {text}"),
            )
        # After each benchmark, so that an interrupted run keeps what it has.
        for report in run(plan):
            written = write(report, target, earlier)
    for path in written:
        click.echo(f"wrote {path}")
    for section in report.sections:
        for goal in section.goals:
            limit = f"{'at most' if goal.at_most else 'at least'} {goal.wanted:.3g}"
            click.echo(f"{goal.what}: {goal.ratio}, {limit} wanted")
    for found in report.disagreements:
        click.echo(
            f"{found.what}: pictures differ by {found.largest:.3g}, {found.allowed:g} is allowed",
            err=True,
        )
    if report.disagreements:
        raise SystemExit(1)


if __name__ == "__main__":
    command(prog_name="python -m benchmarks")
