"""``vkbloom flare``: report the flare of a camera, or of a bloom, by the standards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import click
import numpy as np
from rich.console import Console

from vkbloom._cli.fields import SIZE, Command
from vkbloom._cli.image_files import opened, silence
from vkbloom._cli.program import adapter_option, as_wrong_use, is_given
from vkbloom._cli.sequences import as_file
from vkbloom._cli.settings_options import settings_options
from vkbloom._cli.targets import check_target
from vkbloom._cli.terminal import Form, is_quiet, json_option, say
from vkbloom._io import safe_writing
from vkbloom._io.array_files import write
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._settings.settings import Settings
from vkbloom.testing._flare.chart import FlareChart
from vkbloom.testing._flare.report import FlareReport, report_flare
from vkbloom.testing._flare.shots import ROLES, SEVERAL
from vkbloom.testing._flare.standards import NAMES

_ABOVE_0: Final = click.FloatRange(0, min_open=True)
#: The file of the charts' geometry, beside the charts.
_LAYOUT: Final = "layout.json"

#: What the options of pictures show, by role.
_SHOWN: Final[Mapping[str, str]] = {
    "chart": "Picture of nine black spots in white.",
    "chart_long": "The same at 8 times the exposure.",
    "black": "Picture of black without white, at 8 times the exposure.",
    "spots": "A picture of one black spot in white; give nine.",
    "lights": "A picture of one light in the dark; give nine.",
    "direct": "Picture of a light that is not saturated.",
    "diffuser": "Picture of a white diffuser.",
    "dark_frame": "Picture without light, whose mean is the dark level.",
}


def _standards(_: click.Context, __: click.Parameter, text: str) -> tuple[str, ...] | str:
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    unknown = [name for name in names if name not in ("all", *NAMES)]
    if unknown or not names:
        raise click.BadParameter(f"{text!r} is not one of all, {', '.join(NAMES)}")
    return "all" if "all" in names else names


def _exposures(_: click.Context, __: click.Parameter, words: tuple[str, ...]) -> dict[str, float]:
    exposures = {}
    for word in words:
        role, sign, factor = word.partition("=")
        role = role.replace("-", "_")
        try:
            exposures[role] = float(factor)
        except ValueError:
            sign = ""
        if not sign or role not in ROLES:
            names = ", ".join(role.replace("_", "-") for role in ROLES)
            raise click.BadParameter(f"{word!r} is not PICTURE=FACTOR; PICTURE is one of {names}")
    return exposures


def _picture_options(command: Any) -> Any:
    for role in reversed(ROLES):
        command = click.option(
            f"--{role.replace('_', '-')}",
            role,
            metavar="FILE",
            type=click.Path(),
            multiple=role in SEVERAL,
            help=_SHOWN[role],
        )(command)
    return command


@click.command(cls=Command)
@_picture_options
@click.option(
    "--draw", metavar="FOLDER", type=click.Path(), help="Write the charts to show or to print."
)
@click.option(
    "--suffix", default=".png", help="The type of files that --draw writes, such as .exr."
)
@click.option("--standard", default="all", callback=_standards, help=f"all, or {','.join(NAMES)}.")
@click.option("--size", type=SIZE, default="480x320", help="Of charts that are drawn.")
@click.option(
    "--contrast", type=click.FloatRange(1, min_open=True), help="White by black of the chart."
)
@click.option(
    "--layout",
    metavar="FILE",
    type=click.Path(),
    help=f"Where spots and lights are in the pictures, as --draw writes {_LAYOUT}.",
)
@click.option(
    "--exposed",
    "exposures",
    metavar="PICTURE=FACTOR",
    multiple=True,
    callback=_exposures,
    help="Exposure of a picture relative to the others [default chart-long and black 8, else 1]",
)
@click.option("--dark", metavar="LEVEL", default=0.0, help="Dark level, 0 to 1 of the values.")
@click.option("--saturation", metavar="LEVEL", type=_ABOVE_0, help="The largest value of a pixel.")
@click.option("--raw", is_flag=True, help="The integers of the files are linear, not sRGB.")
@click.option("--pixels-per-degree", "scale", type=_ABOVE_0, help="Of the pictures.")
@click.option("--diffuser-luminance", type=_ABOVE_0, help="Of the diffuser, in cd/m2.")
@click.option("--illuminance", type=_ABOVE_0, help="Of the light at the camera, in lux.")
@json_option("Print one object.")
@click.option("--html", "page", metavar="FILE", type=click.Path(), help="Write a page.")
@click.option(
    "--markdown", metavar="FILE", type=click.Path(), help="Write a table for a pull request."
)
@adapter_option
@settings_options
def command(
    *,
    draw: str | None,
    suffix: str,
    size: tuple[int, int],
    layout: str | None,
    form: Form,
    page: str | None,
    markdown: str | None,
    adapter: str,
    settings: Settings,
    **how: Any,
) -> None:
    """Report flare by the standards: IEEE 2020, ISO 9358, ISO 18844.

    Give pictures of the charts, or --preset or --method for a bloom, which is given the charts.
    Prints flare intensity and normalized flare, veiling glare index, and flare of the types A, B
    and C, each over nine positions, as far as the pictures give them; the report names what is
    missing, the conditions, the formulas with their sources, and what of the standards' texts was
    not seen. --draw writes the charts.
    """
    for target in (page, markdown):
        if target is not None:
            check_target(target)
    pictures = {role: [*how[role]] if role in SEVERAL else how[role] for role in ROLES if how[role]}
    is_bloom = is_given("preset") or is_given("method")
    if sum((draw is not None, bool(pictures), is_bloom)) != 1:
        raise click.UsageError(
            "give pictures, such as --chart FILE, or --preset or --method, or --draw FOLDER"
        )
    if draw is not None:
        _draw(_chart(size, layout, how["contrast"]), Path(draw), suffix)
        return
    options = {name: how[name] for name in ("standard", "exposures", "dark", "saturation")}
    options["pixels_per_degree"] = how["scale"]
    with Console(stderr=True, quiet=is_quiet()).status("") as bar:
        if is_bloom:
            options["chart"] = _chart(size, layout, how["contrast"])
            options["name"] = click.get_current_context().params["preset"] or settings.method
            with open_renderer(adapter) as renderer:
                found = report_flare(settings, renderer=renderer, progress=bar.update, **options)
        else:
            for name in ("raw", "diffuser_luminance", "illuminance"):
                options[name] = how[name]
            options["chart"] = _chart_of(pictures, layout, how["contrast"])
            with silence():
                found = report_flare(pictures, **options)
    _print(found, form, page, markdown)


def _chart(size: tuple[int, int], layout: str | None, contrast: float | None) -> FlareChart:
    """Return the charts of a layout, or of a size."""
    if layout is not None:
        with as_file(layout) as file:
            return FlareChart.from_json(Path(file).read_text(encoding="utf-8-sig"))
    with as_wrong_use():
        return FlareChart(size=size, contrast=contrast or math.inf)


def _chart_of(
    pictures: Mapping[str, Any], layout: str | None, contrast: float | None
) -> FlareChart | None:
    """Return the charts that pictures show; None: those of their size."""
    if layout is None and contrast is None:
        return None
    first = next(iter(pictures.values()))
    with opened(first[0] if isinstance(first, list) else first, 0) as file:
        height, width = file.stored().pixels.shape[:2]
    return _chart((width, height), layout, contrast)


def _draw(chart: FlareChart, folder: Path, suffix: str) -> None:
    """Write the charts and their geometry."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in chart.names:
        image = chart.draw(name)
        say(f"wrote {write(folder / f'{name}{suffix}', np.ascontiguousarray(image))}")
    target = folder / _LAYOUT
    safe_writing.write_file(target, chart.to_json().encode())
    say(f"wrote {target}")


def _print(found: FlareReport, form: Form, page: str | None, markdown: str | None) -> None:
    is_json = form == "json"
    click.echo(found.to_json() if is_json else str(found))
    for target, text in ((page, found.to_html), (markdown, found.to_markdown)):
        if target is not None:
            safe_writing.write_file(Path(target), text().encode())
            say(f"wrote {target}", err=is_json)
