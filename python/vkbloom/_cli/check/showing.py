"""What was measured of a bloom, as text, as a page, and as tables for a pull request."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import click

from vkbloom._cli.check.measuring import VIEW
from vkbloom._fit.translating import lights
from vkbloom._psf.sampled import samples
from vkbloom._views import markup
from vkbloom._views.markup import Markup, element
from vkbloom._views.pictures import picture, png
from vkbloom.testing._adaptation import Adaptation
from vkbloom.testing._law_report import LawReport, cells
from vkbloom.testing._laws.shape import LEVELS
from vkbloom.testing._probe import BloomError, call
from vkbloom.testing._subject import Subject

Values = Mapping[str, Any]

#: Figures by name: their keys in the values of a bloom, and whether less of them is better.
FIGURES: Final[Mapping[str, tuple[tuple[str, ...], bool]]] = {
    "gain": (("gain",), False),
    "energy of a pixel": (("energy",), False),
    "50 % within, pixels": (("psf", "r50"), False),
    "90 % within, pixels": (("psf", "r90"), False),
    "peak": (("psf", "peak"), False),
    **{
        f"roundness at {level:g}": (("laws", "round", "figures", f"round_{level:g}"), True)
        for level in LEVELS
    },
    "ripple": (("stability", "ripple"), True),
    "jitter, pixels": (("stability", "jitter"), True),
    "shimmer": (("stability", "shimmer"), True),
    "growth": (("stability", "growth"), True),
    "veiling glare index, %": (("veiling_glare_index",), False),
}
#: Colours of rows in a terminal, as `law_report.COLOURS` in HTML.
_COLOURS: Final = {"required": "red", "broken": "yellow", "untested": "bright_black"}


def figure_of(values: Any, keys: Sequence[str]) -> float | None:
    """Return a figure; None if it was not measured."""
    for key in keys:
        values = (values or {}).get(key)
    return None if values is None else float(values)


def words(value: float | None) -> str:
    """Return a figure in words."""
    return "none" if value is None else f"{value:.4g}"


def times(values: Values) -> dict[str, float]:
    """Return the seconds of each pass, and of the shortest run."""
    passes = {each["name"]: each["seconds"] for each in values["passes"]}
    return passes | {"together": values["together"]["shortest"]}


def _tables(values: Values) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Yield the tables of times and of figures: a title, and the rows."""
    width, height = values["size"]
    rows = [(name, f"{1e3 * seconds:.3f} ms") for name, seconds in times(values).items()]
    yield f"Passes at {width} x {height}", rows
    if "energy" not in values:  # of an exposure
        return
    rows = [(name, words(figure_of(values, keys))) for name, (keys, _) in FIGURES.items()]
    near = values["nearest_preset"]
    if near["name"]:
        rows.append(("nearest preset", f"{near['name']}, {near['difference']:.3g} off"))
    for name, off in (values["reference"] or {}).items():
        rows.append((f"{name}, from its reference", f"{off:.2g}"))
    yield "Figures", rows


def as_text(values: Values, report: LawReport) -> str:
    """Return tables for a terminal; broken laws are red if they are required, else yellow."""
    lines = [f"{values['name']}, on {values['adapter']}", ""]
    for title, rows in _tables(values):
        lines += [title, *(f"  {name:<28}{text}" for name, text in rows), ""]
    kinds = {row.name: report.kind(row) for row in report.rows}
    for line in str(report).splitlines():
        kind = kinds.get(line.partition(" ")[0].rstrip(":"), "held")
        lines.append(click.style(line, fg=_COLOURS[kind]) if kind in _COLOURS else line)
    return "\n".join(lines)


def as_markdown(values: Values, report: LawReport) -> str:
    """Return the laws and the figures as tables for a pull request."""
    name = values["name"].replace("`", "'")
    lines = [f"### `{name}`\n\nOn {values['adapter']}.\n"]
    lines.append("| law | held | off by | allowed |\n|---|---|---|---|")
    lines += [f"| {' | '.join((row.name, row.words, *cells(row)))} |" for row in report.rows]
    for title, rows in _tables(values):
        lines.append(f"\n| {title} | |\n|---|---|")
        lines += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join((*lines, ""))


def as_page(values: Values, report: LawReport, subject: Subject | Adaptation) -> str:
    """Return a page with tables; of a bloom also with the point spread and pictures."""
    images = _draw(values, subject) if isinstance(subject, Subject) else []
    tables = [
        part
        for title, rows in _tables(values)
        for part in (element("h2", title), markup.table(rows))
    ]
    return markup.page(
        f"vkbloom check: {values['name']}",
        element("h1", values["name"]),
        element("p", f"On {values['adapter']}."),
        *([element("h2", "Pictures"), *images] if images else []),
        element("h2", "Laws"),
        Markup(report._repr_html_()),
        *tables,
    )


def _draw(values: Values, subject: Subject) -> list[Markup]:
    """Return the point spread and pictures of a bloom."""
    scene, shown = lights(VIEW), {}
    if values["energy"]:
        shown["point spread, logarithmic"] = samples(subject.spread)._repr_png_()
    for name, bloom in (("picture", subject.picture or subject.bloom), ("bloom", subject.bloom)):
        # A bloom that fails here has failed in the laws, too.
        with contextlib.suppress(BloomError):
            shown[name] = png(picture(call(bloom, scene), name))
    return [
        markup.figure(
            markup.image(data, name, width=384 if name in ("picture", "bloom") else 256), name
        )
        for name, data in shown.items()
    ]
