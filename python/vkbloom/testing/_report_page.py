"""The report of a test run: one self-contained HTML page, and the same figures as JSON."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from vkbloom._version import installed_version
from vkbloom._views import markup
from vkbloom._views.markup import element
from vkbloom.testing._records import Figures, Record
from vkbloom.testing._report_parts import Histogram, Part, Shown

__all__ = ["write_report"]

_FORMAT: Final = 1
_OUTCOMES: Final = {
    "failed": "✗ failed",
    "missing": "? no reference",
    "written": "+ reference written",
    "passed": "✓ passed",
    "equal": "✓ equal",
    "within": "✓ within the tolerances",
}
# The page loads no resources, even if a name or message contains markup.
_POLICY: Final = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
)


def write_report(folder: Path, parts: Path, records: Sequence[Record]) -> Path:
    """Write ``index.html`` and ``report.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    ordered = sorted(records, key=lambda record: (record["test"], record["name"]))
    (folder / "report.json").write_text(
        json.dumps(_plain(ordered), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    page = folder / "index.html"
    # Written in pieces, so that the memory holds only a few images at a time.
    with page.open("w", encoding="utf-8") as stream:
        for piece in _page(ordered, parts):
            stream.write(piece)
    shutil.rmtree(parts, ignore_errors=True)
    return page


def _plain(records: Iterable[Record]) -> dict[str, Any]:
    """Return the figures for JSON, which has neither NaN nor infinity."""

    def finite(value: Any) -> Any:
        if isinstance(value, float) and not math.isfinite(value):
            return None
        if isinstance(value, dict):
            return {key: finite(inner) for key, inner in value.items() if key != "part"}
        if isinstance(value, list):
            return [finite(inner) for inner in value]
        return value

    checks = [finite(dict(record)) for record in records]
    return {"format": _FORMAT, "version": installed_version(), "checks": checks}


def _page(records: Sequence[Record], parts: Path) -> Iterable[str]:
    style, script = (
        files("vkbloom.testing").joinpath(name).read_text(encoding="utf-8")
        for name in ("report.css", "report.js")
    )
    failed = [record for record in records if record["outcome"] in ("failed", "missing")]
    yield (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{_title(records, failed)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        '<a class="skip" href="#checks">To the list of all checks</a>\n'
        f"<header><h1>Bloom checks</h1>\n<p>{_title(records, failed)}, vkbloom "
        f"{_text(installed_version())}</p></header>\n<main>\n"
    )
    if failed:
        yield '<section aria-labelledby="first"><h2 id="first">First to differ</h2>\n<ul>\n'
        for index, record in enumerate(failed):
            yield _first(index, record)
        yield "</ul></section>\n"
    for index, record in enumerate(failed):
        yield from _check(f"check{index}", record, parts)
    yield from _table(records, failed)
    yield (
        '</main>\n<dialog aria-labelledby="caption"><form method="dialog">'
        '<div class="kinds" role="group" aria-label="Picture"></div>'
        '<p id="caption" aria-live="polite"></p><button>Close</button></form>'
        f'<img alt=""></dialog>\n<script>\n{script}</script>\n</body>\n</html>\n'
    )


def _title(records: Sequence[Record], failed: Sequence[Record]) -> str:
    count = f"{len(records)} check{'s' * (len(records) != 1)}"
    return f"{len(failed)} of {count} failed" if failed else f"{count} passed"


def _first(index: int, record: Record) -> str:
    where = f'<a href="#check{index}">{_text(record["name"])}</a>'
    if record["first_failure"] is None:
        return f"<li>{where}: there is no reference</li>\n"
    figures = next(
        each for each in record["framebuffers"] if each["name"] == record["first_failure"]
    )
    return (
        f"<li>{where}: <strong>{_text(record['first_failure'])}</strong>, "
        f"{_text(figures['reasons'][0])}{_cause(figures)}</li>\n"
    )


def _cause(figures: Figures) -> str:
    return f". Cause: {_text(figures['cause'])}" if figures["cause"] else ""


def _check(anchor: str, record: Record, parts: Path) -> Iterable[str]:
    yield (
        f'<article id="{anchor}" class="check"><h2>{_text(record["name"])}</h2>\n'
        f"<p><code>{_text(record['test'])}</code></p>\n"
    )
    if record["outcome"] == "missing":
        yield f"<p>{_text(record['message'] or 'There is no reference.')}</p></article>\n"
        return
    yield (
        f"<p>The first framebuffer that differs is <strong>{_text(record['first_failure'])}"
        f"</strong>.</p>\n<dl><dt>Expected from</dt><dd>{_text(record['reference_origin'])}</dd>"
        f"<dt>Actual from</dt><dd>{_text(record['origin'])}</dd></dl>\n"
        '<nav aria-label="Framebuffers in the order that the data flows"><ol class="flow">\n'
    )
    for figures in record["framebuffers"]:
        first = figures["name"] == record["first_failure"]
        yield (
            f'<li class="{figures["outcome"]}"><a href="#{anchor}-{_text(figures["name"])}">'
            f"{_text(figures['name'])}</a> <span>{_OUTCOMES[figures['outcome']]}"
            f"{', first to differ' if first else ''}</span></li>\n"
        )
    yield "</ol></nav>\n"
    part: Part = []
    if record["part"] is not None:
        part = json.loads((parts / record["part"]).read_text(encoding="utf-8"))
    shown = {each["name"]: each for each in part}
    for figures in record["framebuffers"]:
        yield from _framebuffer(anchor, figures, shown.get(figures["name"]))
    yield "</article>\n"


def _framebuffer(anchor: str, figures: Figures, shown: Shown | None) -> Iterable[str]:
    name = _text(figures["name"])
    yield (
        f'<section id="{anchor}-{name}" class="framebuffer {figures["outcome"]}">'
        f"<h3>{name} <span>{_OUTCOMES[figures['outcome']]}</span></h3>\n"
    )
    if figures["reasons"]:
        reasons = "".join(f"<li>{_text(reason)}</li>" for reason in figures["reasons"])
        yield f'<ul class="reasons">{reasons}</ul>\n'
    if figures["cause"]:
        yield f"<p>Cause: {_text(figures['cause'])}</p>\n"
    yield _figures_table(figures)
    if shown is not None:
        yield from _pictures(f"{anchor}-{name}", figures, shown)
        if shown["histogram"] is not None:
            yield _histogram(shown["histogram"])
        if shown["worst"]:
            yield _worst(figures, shown)
    yield "</section>\n"


def _figures_table(figures: Figures) -> str:
    size = ""
    if figures["shape"] is not None:
        height, width, *channels = figures["shape"]
        size = f"{width} × {height}{' × '.join(['', *map(str, channels)])} {figures['dtype']}"
    tolerance = f"{figures['atol']:.4g}"
    if figures["rtol"]:
        tolerance += f" + {figures['rtol']:.4g} × |expected|"
    rows = {
        "Size": size,
        "Allowed": tolerance,
        "Largest difference": _number(figures["max_error"]),
        "Mean difference": _number(figures["mean_error"]),
        "Pixels that differ by more": _number(figures["percent_over"], " %"),
        "SSIM": _number(figures["ssim"]),
        "FLIP": _number(figures["flip"]),
    }
    table = markup.table([row for row in rows.items() if row[1]], class_="figures")
    return f"{table}\n"


def _pictures(group: str, figures: Figures, shown: Shown) -> Iterable[str]:
    kinds: list[tuple[str, str | None, str]] = [
        ("expected", shown["expected"], "expected"),
        (
            "actual",
            shown["actual"],
            "actual and expected" if figures["outcome"] == "equal" else "actual",
        ),
        ("difference", shown["difference"], f"difference × {shown['magnified']:.4g}"),
        ("flip", shown["flip"], f"FLIP, mean {_number(shown['flip_mean'])}, black 0, light 1"),
    ]
    yield f'<div class="pictures" data-group="{group}">\n'
    for kind, data, caption in kinds:
        if data is not None:
            text = f"{figures['name']}, {caption}"
            button = element(
                "button",
                markup.encoded_image(data, text),
                type="button",
                data_kind=kind,
                aria_label=f"Enlarge: {text}",
            )
            yield f"{markup.figure(button, caption)}\n"
    yield "</div>\n"
    if shown["shrunk"]:
        yield (
            "<p>The images are smaller than the framebuffer. Each pixel is the mean of a group of "
            "pixels; in the difference and in FLIP, it is the largest value of the group.</p>\n"
        )
    if shown["flip_note"] is not None:
        yield f"<p>FLIP: {_text(shown['flip_note'])}</p>\n"


def _histogram(histogram: Histogram) -> str:
    """Draw bars whose height is the logarithm of the count."""
    counts = histogram["counts"]
    width, height = 10, 100
    tallest = math.log1p(max(counts))
    bars = "".join(
        f'<rect x="{index * width}" y="{height - bar:.1f}" width="{width - 1}" height="{bar:.1f}"/>'
        for index, bar in enumerate(height * math.log1p(count) / tallest for count in counts)
        if bar
    )
    middle = len(counts) // 2
    lower, around, higher = sum(counts[:middle]), counts[middle], sum(counts[middle + 1 :])
    summary = f"{lower} values are lower than expected, {around} equal or nearly, {higher} higher"
    return (
        '<figure class="histogram"><svg role="img" viewBox="0 0 '
        f'{width * len(counts)} {height}" preserveAspectRatio="none" '
        f'aria-label="Histogram of actual less expected: {summary}">{bars}</svg>'
        f'<div class="axis" aria-hidden="true"><span>{histogram["low"]:.3g}</span>'
        f"<span>0</span><span>{histogram['high']:.3g}</span></div>"
        f"<figcaption>Actual less expected, logarithmic counts: {summary}.</figcaption></figure>\n"
    )


def _worst(figures: Figures, shown: Shown) -> str:
    at = figures["max_error_at"] or [0, 0, 0]
    place = f"x {at[0]}, y {at[1]}, channel {at[2]}"
    values = {"expected": shown["worst_expected"], "actual": shown["worst_actual"]}
    rows = [(label, *(f"{value:.6g}" for value in row)) for label, row in values.items()]
    crops = [
        markup.figure(markup.encoded_image(data, f"around {place}: {kind}", class_="crop"), kind)
        for kind, data in shown["worst"].items()
    ]
    x, y = shown["worst_at"] or (0, 0)
    where = f"Its surroundings; it is pixel {x + 1} from the left, {y + 1} from the top."
    worst = element(
        "div",
        element("h4", f"Worst pixel: {place}"),
        markup.table(rows, class_="figures"),
        element("div", *crops, class_="crops"),
        element("p", where),
        class_="worst",
    )
    return f"{worst}\n"


def _table(records: Sequence[Record], failed: Sequence[Record]) -> Iterable[str]:
    anchors = {id(record): f"check{index}" for index, record in enumerate(failed)}
    rows = []
    for record in records:
        anchor = anchors.get(id(record))
        largest = max(
            (each["max_error"] or 0.0 for each in record["framebuffers"]), default=math.nan
        )
        name = record["name"]
        rows.append(
            (
                element("a", name, href=f"#{anchor}") if anchor else name,
                element("span", _OUTCOMES[record["outcome"]], class_=record["outcome"]),
                record["first_failure"] or "",
                "" if math.isnan(largest) else f"{largest:.4g}",
                element("code", record["test"]),
            )
        )
    head = ("Check", "Result", "First to differ", "Largest difference", "Test")
    heading = element("h2", "All checks", id="checks")
    table = element("div", markup.table(rows, head), class_="wide")
    yield f"{element('section', heading, table, aria_labelledby='checks')}\n"


def _number(value: float | None, unit: str = "") -> str:
    return "" if value is None else f"{value:.4g}{unit}"


def _text(value: object) -> str:
    return markup.joined((value,))
