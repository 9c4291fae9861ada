"""``vkbloom check``: the command."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
import runpy
import shlex
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import click
from rich.console import Console
from rich.status import Status

from vkbloom._cli.check import comparing, measuring, showing
from vkbloom._cli.check.sequences import check_unused, judge, sequence_options
from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.program import adapter_option, as_wrong_use, is_given
from vkbloom._cli.settings_options import settings_options
from vkbloom._cli.targets import check_target
from vkbloom._cli.terminal import is_quiet, note, say
from vkbloom._custom.method import CustomMethod, identifier_of, load_method
from vkbloom._io import safe_writing
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.settings import Settings, presets
from vkbloom._spelling import did_you_mean
from vkbloom.testing._law_report import LawReport, law_report
from vkbloom.testing._laws.table import find_law, merge_limits
from vkbloom.testing._programs import CommandBloom
from vkbloom.testing._subject import Subject

# Runs whose times are measured; of two blooms, in turns.
_RUNS: Final = 5
_ABOVE_0: Final = click.FloatRange(0, min_open=True)


class CheckCommand(Command):
    """A command whose argument is a file of a custom method, which adds options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Load the file before the options are parsed, so that its parameters are options."""
        taking = {
            name
            for param in self.get_params(ctx)
            if isinstance(param, click.Option) and not param.is_flag
            for name in param.opts
        }
        words = list(args)
        for index, word in enumerate(words):
            if word.startswith("-") or (index and words[index - 1] in taking):
                continue
            if os.path.isfile(word):
                words[index : index + 1] = ["--method", load_method(word).method]
                break
        return super().parse_args(ctx, words)


def _laws(_: click.Context, __: click.Parameter, text: str) -> tuple[str, ...]:
    try:
        return tuple(dict.fromkeys(find_law(name) for name in text.split(",") if name.strip()))
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


@click.command(cls=CheckCommand)
@click.argument("file", required=False, metavar="[FILE]")
@click.option(
    "--command", "program", metavar="'PROGRAM {input} {output}'", help="Measure a program."
)
@click.option("--suffix", default=".exr", help="The type of the program's image files.")
@click.option(
    "--timeout", type=_ABOVE_0, default=60.0, help="Of one run of the program, in seconds."
)
@click.option(
    "--less-input", is_flag=True, help="Measure the program's bloom alone, less its input."
)
@click.option(
    "--reference", metavar="FILE.py:FUNCTION", help="A reference of the framebuffers in NumPy."
)
@click.option("--gain", type=click.FloatRange(0), help="The gain of flat images, else measured.")
@click.option(
    "--measure-size", "measured", type=SIZE, default="256x256", help="Of the test images."
)
@click.option("--size", type=SIZE, default="1280x720", help="Size of the times.")
@click.option(
    "--require", metavar="LAW,...", default="", callback=_laws, help="Fail if one is not held."
)
@click.option(
    "--against", metavar="FILE|PRESET|COMMAND", help="Another bloom, and what changed since then."
)
@click.option(
    "--sequence", metavar="PATTERN", help="Judge frames in time instead, such as f.%04d.exr."
)
@sequence_options
@click.option("--json", "as_json", is_flag=True, help="Print one object.")
@click.option(
    "--html", "page", metavar="FILE", type=click.Path(), help="Write a page with pictures."
)
@click.option(
    "--markdown", metavar="FILE", type=click.Path(), help="Write tables for a pull request."
)
@adapter_option
@settings_options
def check(
    *,
    file: str | None,
    program: str | None,
    reference: str | None,
    against: str | None,
    sequence: str | None,
    as_json: bool,
    page: str | None,
    markdown: str | None,
    adapter: str,
    settings: Settings,
    **how: Any,
) -> int:
    """Measure what a bloom is worth.

    FILE is a custom method; its parameters are options. Or give --preset, --method, --command, or
    --sequence.
    Prints the passes and their times; each law, held or by how much it is not; energy, point
    spread, stability of a moving light, response to the resolution, veiling glare index, the
    differences from the reference, and the nearest preset. Laws are measured with buffers of 32-bit
    floats, unless --format is given. With --against, prints both and what changed.

    The exit status is 1 if a law of --require is not held, or was not tested.
    """
    for target in (page, markdown):
        if target is not None:
            check_target(target)
    if sequence is not None:
        if file or program or against or is_given("preset") or is_given("method"):
            raise click.UsageError("--sequence judges files alone, without a bloom")
        return judge(sequence, how, as_json=as_json)
    check_unused()
    params = click.get_current_context().params
    _check_choice(params)
    console = Console(stderr=True, quiet=is_quiet())
    with open_renderer(adapter) as renderer, console.status("") as bar:
        if reference is not None:
            _add_reference(settings, reference)
        sources = {program or params["preset"] or settings.method: program or settings}
        if against is not None:
            sources[against if against not in sources else f"{against} (against)"] = _other(
                against, settings
            )
        opened = [_open_bloom(renderer, *source, how, bar) for source in sources.items()]
        blooms = _measure(opened, how, bar)
        (values, report, subject), *others = blooms
        name = values["name"]
        if page is not None:
            text = showing.as_page(values, report, subject)
            safe_writing.write_file(Path(page), text.encode())
            say(f"wrote {page}", err=as_json)
    if not others:
        failed = [row.name for row in report.rows if row.name in report.required and not row.held]
        text, table = showing.as_text(values, report), showing.as_markdown(values, report)
    else:
        before = others[0][0]
        changes = comparing.changes(before, values)
        failed = comparing.find_newly_broken(changes, how["require"])
        names = (before["name"], name)
        text = comparing.as_text(changes, names)
        table = comparing.as_markdown(changes, names, values["adapter"])
        values = comparing.as_values(changes, before, values, failed)
    click.echo(json.dumps(values, indent=2) if as_json else text)
    if markdown is not None:
        safe_writing.write_file(Path(markdown), table.encode())
        say(f"wrote {markdown}", err=as_json)
    held = {row.name: row.words for row in report.rows}
    for law in failed:
        since = "newly broken, " if others else ""
        note(f"{name}: required law {law}: {since}{held[law]}")
    return int(bool(failed))


@dataclasses.dataclass
class _Opened:
    """A bloom that has run once. `program`, `settings`: one is None; `law`: what is tested."""

    name: str
    subject: Subject
    timer: Callable[[], Mapping[str, float]]
    device: str
    program: CommandBloom | None = None
    settings: Settings | None = None
    law: str = "first run"

    def show(self, bar: Status, law: str | None = None) -> None:
        """Show which law is tested, and which run of a program this is."""
        self.law = law or self.law
        runs = ""
        if self.program is not None:
            levels = self.program.levels
            total = measuring.RUNS[levels is not None and levels.is_coarse]
            runs = f", run {self.program.runs} of {max(total, self.program.runs)}"
        bar.update(f"{self.name}: {self.law}{runs}")


def _open_bloom(
    renderer: Renderer,
    name: str,
    source: str | Settings,
    how: Mapping[str, Any],
    bar: Status,
) -> _Opened:
    """Return the bloom of settings, or of a command, which is run to see what it writes."""
    size = how["size"]
    if not isinstance(source, str):
        subject = measuring.of_settings(renderer, source, how["measured"], how["gain"])

        def passes() -> Mapping[str, float]:
            return measuring.pass_times(renderer, source, size)

        return _Opened(name, subject, passes, renderer.info.summary, settings=source)
    with as_wrong_use():
        run = CommandBloom(shlex.split(source), how["suffix"], how["timeout"])
    with _notes():
        subject = measuring.of_program(
            run, how["measured"], how["gain"], less_input=how["less_input"]
        )
    opened = _Opened(
        name, subject, lambda: measuring.run_time(run, size), "this machine", program=run
    )
    run.on_run = lambda _: opened.show(bar)
    return opened


def _measure(
    opened: list[_Opened], how: Mapping[str, Any], bar: Status
) -> list[tuple[dict[str, Any], LawReport, Subject]]:
    """Return what is measured of blooms, as the options say."""
    # Of one program, a run is long, and its time is only shown.
    is_compared = len(opened) > 1
    runs = _RUNS if is_compared or opened[0].program is None else 1
    times = measuring.in_turns([each.timer for each in opened], runs)
    results = []
    for each, seconds in zip(opened, times, strict=True):
        try:
            report = law_report(
                each.subject, merge_limits({}), how["require"], functools.partial(each.show, bar)
            )
            each.law = "figures"
            about = {"name": each.name, "adapter": each.device, "size": how["size"]}
            values = measuring.values_of(each.subject, report, each.settings, **about, **seconds)
            results.append((values, report, each.subject))
        except AssertionError as error:
            raise click.ClickException(f"{each.name}: {error}") from error
    return results


def _other(against: str, settings: Settings) -> str | Settings:
    """Return what --against names: a command, or settings.

    Of a file, parameters have the values that differ from the defaults of the first bloom.
    """
    if "{input}" in against:
        return against
    if os.path.isfile(against):
        # Another name, so that it does not replace a file of the same name.
        kind = load_method(against, name=f"{identifier_of(Path(against).stem)}_against")
        usual, other = type(settings)(), kind()
        changed = {
            field.name: getattr(settings, field.name)
            for field in dataclasses.fields(settings)
            if hasattr(other, field.name)
            and getattr(settings, field.name) != getattr(usual, field.name, None)
        }
        return other.replace(**changed) if isinstance(settings, CustomMethod) else other
    if against not in presets:
        near = did_you_mean(against, presets)
        raise click.UsageError(
            f"--against: {against!r} is not a file, a preset, or a command with {{input}}{near}"
        )
    return presets[against]


def _check_choice(params: Mapping[str, Any]) -> None:
    """Raise click.UsageError for parameters that do not go together."""
    program = params["program"]
    if params["file"] is not None:
        raise click.UsageError(f"{params['file']}: there is no such file")
    if params["against"] is not None and params["page"] is not None:
        raise click.UsageError("--html shows one bloom; --against writes --markdown")
    chosen = [name for name in ("preset", "method") if is_given(name)]
    if program is not None and chosen:
        raise click.UsageError(f"--command cannot be combined with --{chosen[0]} or FILE")
    if program is not None and params["reference"] is not None:
        raise click.UsageError("--reference needs FILE; a program has one framebuffer")
    if program is None and not chosen:
        raise click.UsageError("give FILE, --preset NAME, --method NAME or --command PROGRAM")


@contextmanager
def _notes() -> Iterator[None]:
    """Print warnings as notes, without their advice for tests."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        yield
    for warning in caught:
        note(str(warning.message).partition("; ")[0])


def _add_reference(settings: Settings, where: str) -> None:
    """Give a custom method its reference, FILE.py:FUNCTION."""
    path, _, function = where.rpartition(":")
    if not isinstance(settings, CustomMethod):
        raise click.UsageError("--reference needs FILE; presets have the package's own reference")
    if not path or not os.path.isfile(path):
        raise click.UsageError(f"--reference: {where!r} is not FILE.py:FUNCTION of a file")
    reference: Callable[..., Any] | None = runpy.run_path(path).get(function)
    if not callable(reference):
        raise click.UsageError(f"--reference: {path} has no function {function!r}")
    type(settings).numpy_reference = staticmethod(reference)
