"""What was measured of a bloom, as text, as plain values for JSON, and as a page."""

from __future__ import annotations

import math
from typing import Any, Final

import click

from vkbloom._fit.translating import lights
from vkbloom._views import markup
from vkbloom._views.markup import Markup, element
from vkbloom._views.pictures import picture, png
from vkbloom._views.plain_values import plain
from vkbloom.psf._sampled import samples
from vkbloom.testing._law_report import LawReport, LawRow
from vkbloom.testing._measuring import VIEW, Measured

_OF_A_LAW: Final = ("held", "off", "limit", "figures", "law", "message", "why")
#: Colours of rows in a terminal, as `law_report.COLOURS` in HTML.
_COLOURS: Final = {"required": "red", "broken": "yellow", "untested": "bright_black"}


def as_text(measured: Measured) -> str:
    """Return tables for a terminal; broken laws are red if they are required, else yellow."""
    lines = [f"{measured.name}, on {measured.device}", ""]
    width, height = measured.size
    lines.append(f"passes at {width} x {height}{'':<10} ms")
    for name, seconds in measured.passes.items():
        lines.append(f"  {name:<24}{1000 * seconds:8.3f}")
    lines.append(f"  {'together':<24}{1000 * sum(measured.passes.values()):8.3f}")
    lines += [
        "",
        "figures",
        *(f"  {name:<24}{text}" for name, text in figures(measured).items()),
        "",
    ]
    report = measured.report
    kinds = {row.name: report.kind(row) for row in report.rows}
    for line in str(report).splitlines():
        kind = kinds.get(line.partition(" ")[0].rstrip(":"), "held")
        lines.append(click.style(line, fg=_COLOURS[kind]) if kind in _COLOURS else line)
    return "\n".join(lines)


def figures(measured: Measured) -> dict[str, str]:
    """Return the figures as words, by their name."""
    spread, steady, response = (
        measured.spread,
        measured.subject.stability,
        measured.subject.resolution,
    )
    sizes = ", ".join(f"{height}" for _, height in response.sizes)
    texts = {
        "gain of flat images": f"{measured.report.gain:.4g}",
        "energy of a pixel": f"{spread.energy:.4g} ({100 * spread.at_border:.2g} % at the border)",
        "point spread": f"50 % within {spread.r50:g} and 90 % within {spread.r90:g} pixels, "
        f"peak {spread.peak:.3g}",
        "moving light": f"ripple {_percent(steady.ripple)}, jitter {steady.jitter:.2g} pixels, "
        f"flicker {_percent(steady.flicker)} ({_percent(steady.shimmer)} beside a convolution), "
        f"growth {_percent(steady.growth)}",
        "radius of 90 %": f"{', '.join(_percent(value) for value in response.r90)} of the height "
        f"at heights of {sizes}",
        "veiling glare index": f"{measured.veiling_glare_index:.3g} %",
        "nearest preset": f"{measured.nearest[0]}, {_percent(measured.nearest[1])} off"
        if measured.nearest[0]
        else "none: the bloom is black",
    }
    if measured.subject.reference:
        texts["from its reference"] = ", ".join(
            f"{name} {off:.2g}" for name, off in measured.subject.reference.items()
        )
    return texts


def as_values(measured: Measured) -> dict[str, Any]:
    """Return everything as plain values; what is not a number is None."""
    spread, steady, response = (
        measured.spread,
        measured.subject.stability,
        measured.subject.resolution,
    )
    value: dict[str, Any] = plain(
        {
            "name": measured.name,
            "adapter": measured.device,
            "settings": None if measured.settings is None else measured.settings.to_dict(),
            "size": measured.size,
            "passes": [{"name": name, "seconds": s} for name, s in measured.passes.items()],
            "laws": {
                row.name: {name: getattr(row, name) for name in _OF_A_LAW}
                for row in measured.report.rows
            },
            "untaken": measured.report.untaken,
            "gain": measured.report.gain,
            "energy": spread.energy,
            "psf": {
                name: getattr(spread, name)
                for name in ("r50", "r90", "peak", "at_border", "radii", "encircled")
            },
            "stability": {
                name: getattr(steady, name)
                for name in ("ripple", "jitter", "flicker", "shimmer", "growth")
            },
            "resolution": {
                name: getattr(response, name) for name in ("sizes", "r50", "r90", "peak")
            },
            "veiling_glare_index": measured.veiling_glare_index,
            "reference": measured.subject.reference or None,
            "nearest_preset": {
                "name": measured.nearest[0] or None,
                "difference": measured.nearest[1],
            },
            "required": measured.report.required,
            "passed": not broken(measured.report),
        }
    )
    return value


def as_markdown(measured: Measured) -> str:
    """Return the laws and the figures as tables for a pull request."""
    laws = [
        f"| {row.name} | {row.words} | {cells[0]} | {cells[1]} |"
        for row in measured.report.rows
        for cells in [("", "") if math.isnan(row.off) else (f"{row.off:.3g}", f"{row.limit:.3g}")]
    ]
    times = {"passes together": f"{1000 * sum(measured.passes.values()):.3f} ms"}
    shown = [f"| {name} | {text} |" for name, text in (figures(measured) | times).items()]
    head = f"### `{measured.name.replace('`', chr(39))}`\n\nOn {measured.device}.\n"
    tables = ("| law | held | off by | allowed |\n|---|---|---|---|", *laws, "")
    return "\n".join((head, *tables, "| figure | |\n|---|---|", *shown, ""))


def broken(report: LawReport) -> list[LawRow]:
    """Return the required laws that are not held."""
    return [row for row in report.rows if row.name in report.required and not row.held]


def as_page(measured: Measured) -> str:
    """Return a page with tables, the point spread, and pictures."""
    spread, subject = measured.spread, measured.subject
    scene = lights(VIEW)
    pictures = {"picture": (subject.picture or subject.bloom)(scene), "bloom": subject.bloom(scene)}
    times = [(name, f"{1000 * seconds:.3f} ms") for name, seconds in measured.passes.items()]
    shown = (
        {"point spread, logarithmic": samples(spread.array)._repr_png_()} if spread.energy else {}
    )
    shown |= {name: png(picture(image, name)) for name, image in pictures.items()}
    images = [
        markup.figure(markup.image(data, name, width=_width(name)), name)
        for name, data in shown.items()
    ]
    width, height = measured.size
    return markup.page(
        f"vkbloom check: {measured.name}",
        element("h1", measured.name),
        element("p", f"On {measured.device}."),
        element("h2", "Pictures"),
        *images,
        element("h2", "Laws"),
        Markup(measured.report._repr_html_()),
        element("h2", "Figures"),
        markup.table(figures(measured).items()),
        element("h2", f"Passes at {width} x {height}"),
        markup.table(times),
    )


def _width(name: str) -> int:
    return 256 if name.startswith("point") else 384


def _percent(share: float) -> str:
    return "none" if math.isnan(share) else f"{float(f'{100 * share:.3g}'):g} %"
