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
from typing import Any, Final, TypeAlias

import click
from rich.console import Console
from rich.status import Status

from vkbloom._cli.check import comparing, measuring, showing
from vkbloom._cli.check.measuring import Exposed
from vkbloom._cli.check.sequences import Make, check_unused, is_made, judge, sequence_options
from vkbloom._cli.fields import EXPOSURE, SIZE, Command, FieldOption
from vkbloom._cli.program import adapter_option, as_wrong_use, is_given
from vkbloom._cli.settings_options import STARTS, settings_options
from vkbloom._cli.targets import check_target
from vkbloom._cli.terminal import is_quiet, note, say
from vkbloom._custom.described.generate import is_shader
from vkbloom._custom.method import CustomMethod, identifier_of, load_method, load_shaders
from vkbloom._io import safe_writing
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.antialiasing import Antialiasing
from vkbloom._settings.exposure import Exposure, exposures
from vkbloom._settings.settings import Settings, presets
from vkbloom._spelling import describe_unknown, did_you_mean
from vkbloom.testing._adaptation import NO_BLOOM, Adaptation, meter_of
from vkbloom.testing._adaptation import SIZE as EXPOSURE_SIZE
from vkbloom.testing._blooms import exact
from vkbloom.testing._law_report import LawReport, law_report
from vkbloom.testing._laws.table import find_law, merge_limits
from vkbloom.testing._programs import CommandBloom, CommandMeter, command_of
from vkbloom.testing._subject import Subject

# Runs whose times are measured; of two blooms, in turns.
_RUNS: Final = 5
_ABOVE_0: Final = click.FloatRange(0, min_open=True)


#: What is measured: a command, the bloom of settings, or an exposure.
_Source: TypeAlias = str | Settings | Exposed


class CheckCommand(Command):
    """A command whose argument is a custom method, of one file or several, which adds options."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Leave out the field `exposure`: laws are measured without it, and an exposure has one."""
        return [
            param
            for param in super().get_params(ctx)
            if not (isinstance(param, FieldOption) and param.field == "exposure")
        ]

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
                end = index + 1
                while end < len(words) and is_shader(word) and is_shader(words[end]):
                    end += 1
                files = words[index:end]
                kind = load_method(word) if len(files) == 1 else load_shaders(files)
                words[index:end] = ["--method", kind.method]
                break
        return super().parse_args(ctx, words)


def _laws(_: click.Context, __: click.Parameter, text: str) -> tuple[str, ...]:
    try:
        return tuple(dict.fromkeys(find_law(name) for name in text.split(",") if name.strip()))
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


@click.command(cls=CheckCommand)
@click.argument("file", required=False, metavar="[FILE...]")
@click.option(
    "--command",
    "program",
    metavar="'PROGRAM {input} {output}'",
    help="Measure a program; with {dt} and {state} it is an exposure.",
)
@click.option(
    "--exposure",
    type=EXPOSURE,
    help="Measure an exposure, alone or beside the bloom of --preset or --method; or that of "
    "--sequence.",
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
    "--sequence",
    metavar="PATTERN|VIDEO",
    help="Judge frames in time instead, such as f.%04d.exr or clip.mp4: as they are, or with the "
    "bloom, the exposure and the --taa that are given.",
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
    exposure: Exposure | float | None,
    as_json: bool,
    page: str | None,
    markdown: str | None,
    adapter: str,
    settings: Settings,
    **how: Any,
) -> int:
    """Measure what a bloom or an exposure is worth.

    FILE is a custom method; its parameters are options: passes (.hook), a description (.toml), or
    shaders that need none. Or give --preset, --method, --exposure, --command, or --sequence.
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
        for name, given in (("FILE", file), ("--command", program), ("--against", against)):
            if given is not None:
                raise click.UsageError(f"--sequence judges frames; leave {name} out")
        with _opened_maker(adapter, settings, exposure, how["antialiasing"]) as make:
            return judge(sequence, how, as_json=as_json, make=make)
    check_unused()
    params = click.get_current_context().params
    _check_choice(params)
    console = Console(stderr=True, quiet=is_quiet())
    with open_renderer(adapter) as renderer, console.status("") as bar:
        if reference is not None:
            _add_reference(settings, reference)
        sources = dict([_source_of(params, settings)])
        if against is not None:
            (first,) = sources.values()
            sources[against if against not in sources else f"{against} (against)"] = _other(
                against, first, settings
            )
        opened = [_open(renderer, *source, how, bar) for source in sources.items()]
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


@contextmanager
def _opened_maker(
    adapter: str,
    settings: Settings,
    exposure: Exposure | float | None,
    taa: Antialiasing | None,
) -> Iterator[Make | None]:
    """Yield what makes the frames of a sequence, in linear light; None: they are judged as given.

    - `exposure`: A number is in stops.
    """
    if not is_made():
        yield None
        return
    chosen = settings if any(map(is_given, STARTS)) else NO_BLOOM
    chosen = chosen.replace(encoding="none", dither=False)
    stages: dict[str, Any] = {"taa": taa}
    if isinstance(exposure, Exposure):
        stages["exposure"] = exposure
    elif exposure is not None:
        chosen = chosen.replace(exposure=exposure)
    with open_renderer(adapter) as renderer:
        yield lambda images, steps: renderer.map(
            images, chosen, dt=steps, framebuffers="final", **stages
        )


@dataclasses.dataclass
class _Opened:
    """What has run once: a bloom or an exposure. One of `program` and `source` is None.

    - `law`: What is tested.
    """

    name: str
    subject: Subject | Adaptation
    timer: Callable[[], Mapping[str, float]]
    device: str
    program: CommandBloom | CommandMeter | None = None
    source: Settings | Exposed | None = None
    law: str = "first run"

    def show(self, bar: Status, law: str | None = None) -> None:
        """Show which law is tested, and which run of a program this is."""
        self.law = law or self.law
        runs = ""
        if self.program is not None:
            levels = self.program.levels
            total = measuring.RUNS[levels is not None and levels.is_coarse]
            if isinstance(self.subject, Adaptation):
                total = measuring.RUNS_OF_EXPOSURE
            runs = f", run {self.program.runs} of {max(total, self.program.runs)}"
        bar.update(f"{self.name}: {self.law}{runs}")

    def values_of(self, report: LawReport, **about: Any) -> dict[str, Any]:
        """Return all that is measured as plain values."""
        if isinstance(self.subject, Subject):
            settings = self.source if isinstance(self.source, Settings) else None
            return measuring.values_of(self.subject, report, settings, **about)
        exposed = self.source if isinstance(self.source, Exposed) else None
        return measuring.values_of_exposure(report, exposed, **about)


def _source_of(params: Mapping[str, Any], settings: Settings) -> tuple[str, _Source]:
    """Return the name and the source of what the options name."""
    name, exposure = params["preset"] or settings.method, params["exposure"]
    if params["program"] is not None:
        return params["program"], params["program"]
    if not isinstance(exposure, Exposure):
        return name, settings
    called = next((name for name in exposures if exposures[name] == exposure), exposure.engine)
    if is_given("preset") or is_given("method"):
        return f"{called}, {name}", Exposed(exposure, settings)
    return called, Exposed(exposure, None)


def _open(
    renderer: Renderer, name: str, source: _Source, how: Mapping[str, Any], bar: Status
) -> _Opened:
    """Return a bloom or an exposure of the package, or of a command, which is run to see."""
    size, measured = how["size"], how["measured"]
    frame = measured if is_given("measured") else EXPOSURE_SIZE
    if isinstance(source, Exposed):
        exposed = source
        bloom = None if exposed.settings is None else exact(exposed.settings)
        meter = meter_of(exposed.exposure, renderer, bloom)
        subject: Subject | Adaptation = Adaptation(meter=meter, size=frame)

        def passes() -> Mapping[str, float]:
            return measuring.pass_times(renderer, exposed, size)

        return _Opened(name, subject, passes, renderer.info.summary, source=source)
    if isinstance(source, Settings):
        settings = source
        with _as_failure(name):
            subject = measuring.of_settings(renderer, settings, measured, how["gain"])

        def passes() -> Mapping[str, float]:
            return measuring.pass_times(renderer, settings, size)

        return _Opened(name, subject, passes, renderer.info.summary, source=source)
    with as_wrong_use():
        run = command_of(shlex.split(source), how["suffix"], how["timeout"])
    with _notes():
        if isinstance(run, CommandMeter):
            subject = Adaptation(meter=run, size=frame)
        else:
            subject = measuring.of_program(run, measured, how["gain"], less_input=how["less_input"])
    opened = _Opened(
        name, subject, lambda: measuring.run_time(run, size), "this machine", program=run
    )
    run.on_run = lambda _: opened.show(bar)
    return opened


def _measure(
    opened: list[_Opened], how: Mapping[str, Any], bar: Status
) -> list[tuple[dict[str, Any], LawReport, Subject | Adaptation]]:
    """Return what is measured of blooms and exposures, as the options say."""
    # Of one program, a run is long, and its time is only shown.
    is_compared = len(opened) > 1
    runs = _RUNS if is_compared or opened[0].program is None else 1
    times = measuring.in_turns([each.timer for each in opened], runs)
    results = []
    for each, seconds in zip(opened, times, strict=True):
        with _as_failure(each.name):
            report = law_report(
                each.subject, merge_limits({}), how["require"], functools.partial(each.show, bar)
            )
            each.law = "figures"
            about = {"name": each.name, "adapter": each.device, "size": how["size"]}
            values = each.values_of(report, **about, **seconds)
            results.append((values, report, each.subject))
    return results


@contextmanager
def _as_failure(name: str) -> Iterator[None]:
    """Raise click.ClickException for a bloom that cannot be measured."""
    try:
        yield
    except AssertionError as error:
        raise click.ClickException(f"{name}: {error}") from error


def _other(against: str, first: _Source, settings: Settings) -> _Source:
    """Return what --against names: a command, settings, or beside an exposure another one.

    Of a file, parameters have the values that differ from the defaults of the first bloom.
    """
    is_exposure = isinstance(first, Exposed) or (isinstance(first, str) and "{dt}" in first)
    if "{input}" in against:
        if is_exposure != ("{dt}" in against):
            raise click.UsageError("--against: a bloom and an exposure cannot be compared")
        return against
    if is_exposure:
        if against not in exposures:
            raise click.UsageError(f"--against: {describe_unknown('exposure', against, exposures)}")
        return Exposed(exposures[against], first.settings if isinstance(first, Exposed) else None)
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
    is_exposure = isinstance(params["exposure"], Exposure)
    if is_exposure or "{dt}" in (program or ""):
        for name in ("reference", "gain", "less_input"):
            if is_given(name):
                raise click.UsageError(f"--{name.replace('_', '-')} is of a bloom, not an exposure")
    if program is not None and is_exposure:
        raise click.UsageError("--command cannot be combined with --exposure")
    if program is not None and params["reference"] is not None:
        raise click.UsageError("--reference needs FILE; a program has one framebuffer")
    if program is None and not chosen and not is_exposure:
        raise click.UsageError(
            "give FILE, --preset NAME, --method NAME, --exposure NAME or --command PROGRAM"
        )


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
