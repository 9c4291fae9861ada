"""``vkbloom presets``, ``glares``, ``psfs``: list what has a published name."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final, TypeAlias, get_args

import click
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from vkbloom._cli.terminal import Form, json_option
from vkbloom._exposure.presets import PRESETS as PRESET_EXPOSURES
from vkbloom._presets.named_glares import GLARES
from vkbloom._presets.named_settings import PRESETS, Engine
from vkbloom._psf.base import functions
from vkbloom._settings.fields import fields_of
from vkbloom._settings.glare import Glare, GlareLight
from vkbloom._settings.registry import STAGES

# Console width for output to a file or another program, where lines must not be wrapped.
_UNBROKEN: Final = 4096
# The columns of a table before those that are cut, by title.
_TITLES: Final = {
    "name": "name",
    "composite": "composite",
    "needs HDR": "needs_hdr",
    "bloom reads": "bloom_reads",
    "confirmed by": "confirmed",
}


#: What has a published name, as --json prints it: "name"; "what" it looks like; "whose" it is, its
#: source; of blooms "composite", how its light comes into the picture, and "needs_hdr", whether
#: only values above 1 glow; of exposures "bloom_reads", which light; and further keys.
Entry: TypeAlias = dict[str, Any]


def _command(entries: Callable[[], Iterable[Entry]]) -> click.Command:
    """Return the command that lists entries; their docstring is its help."""

    @click.command(help=inspect.getdoc(entries))
    @json_option("Print a list of objects.")
    def command(*, form: Form) -> None:
        if form == "json":
            click.echo(json.dumps(list(entries()), indent=2))
        else:
            _show(_table(entries()))

    return command


def _table(entries: Iterable[Entry]) -> Table:
    """Return a table of one line for each entry; a narrow terminal cuts the last two columns."""
    listed = list(entries)
    titles = {title: key for title, key in _TITLES.items() if any(key in item for item in listed)}
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in titles:
        table.add_column(title, no_wrap=True)
    # Columns that rich makes narrower, with texts that it does not wrap.
    table.add_column("what")
    table.add_column("whose")
    engine = ""
    for item in listed:
        if item.get("engine", "") != engine:
            engine = item["engine"]
            table.add_row(Text(f"{engine}:", style="bold"))
        cut = (Text(item[key], no_wrap=True, overflow="ellipsis") for key in ("what", "whose"))
        table.add_row(*(_word_of(item[key]) for key in titles.values()), *cut)
    return table


def _word_of(value: str | bool) -> str:
    return value if isinstance(value, str) else "yes" if value else "no"


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


def preset_entries() -> Iterator[Entry]:
    """List the presets by engine.

    What they look like, their versions, what confirmed them (frames of the engine's shaders, the
    program itself, or a formula alone), whether they mix or add, and whether they need values above
    1.
    """
    order = get_args(Engine)
    for name, item in sorted(PRESETS.items(), key=lambda row: order.index(row[1].engine)):
        settings = item.make()
        needs_hdr = (settings.threshold or 0) >= 1 and not item.expands
        yield {
            **{"name": name, "what": item.what, "whose": item.whose},
            **{"composite": settings.composite, "needs_hdr": needs_hdr},
            **{"intensity": settings.intensity, "settings": settings.to_dict()},
            **{"engine": item.engine, "confirmed": item.confirmed},
        }


def glare_entries() -> Iterator[Entry]:
    """List what --glare takes: stages and published glares.

    Whose they are, and whether they need values above 1. Stages add their light to the bloom, dirt
    multiplies it.
    """
    for name, kind in STAGES.items():
        what = (inspect.getdoc(kind) or "").partition(".")[0]
        yield _entry(name, what[:1].lower() + what[1:], "a stage with its defaults", (kind(),))
    for name, item in GLARES.items():
        yield _entry(name, item.what, item.whose, item.stages)


def _entry(name: str, what: str, whose: str, stages: Sequence[Glare]) -> Entry:
    lights = [stage for stage in stages if isinstance(stage, GlareLight)]
    composite = "add" if lights else "multiply"
    needs_hdr = bool(lights) and min(stage.threshold for stage in lights) >= 1
    return {
        **{"name": name, "what": what, "whose": whose},
        **{"composite": composite, "needs_hdr": needs_hdr},
        "glare": [stage.to_dict() for stage in stages],
    }


def psf_entries() -> Iterator[Entry]:
    """List the point-spread functions that --method convolution --psf takes, and whose they are.

    They stand for the complete picture: mix them, with the share of the light that they describe
    as the intensity.
    """
    for name, kind in functions().items():
        text = inspect.getdoc(kind) or ""
        what = text.partition("\n")[0].rstrip(".")
        source = re.search(r"^Source: (.+?)(?:[;.] |[;.]?\n\n|[;.]?\Z)", text, re.S | re.M)
        whose = " ".join(source[1].split()).rstrip(".") if source else "vkbloom"
        yield {
            **{"name": name, "what": what[:1].lower() + what[1:], "whose": whose},
            **{"composite": "mix", "needs_hdr": False},
            **{"parameters": list(fields_of(kind)), "unit": kind.unit},
        }


def exposure_entries() -> Iterator[Entry]:
    """List the exposures that --exposure takes: how engines meter a frame and adapt to it.

    What they meter, how they follow it, and which light the bloom reads.
    """
    for name, item in PRESET_EXPOSURES.items():
        exposure = item.make()
        light = "exposed light" if exposure._exposes_bloom else "light"
        yield {
            **{"name": name, "what": item.what, "whose": item.whose},
            **{"bloom_reads": light, "exposure": exposure.to_dict()},
        }


presets, glares, psfs, exposures = map(
    _command, (preset_entries, glare_entries, psf_entries, exposure_entries)
)
