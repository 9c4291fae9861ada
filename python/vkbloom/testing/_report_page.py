"""The report of a test run: one self-contained HTML page, and the same figures as JSON."""

from __future__ import annotations

import html
import json
import math
import shutil
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from vkbloom._version import installed_version
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
    cells = "".join(
        f'<tr><th scope="row">{label}</th><td>{_text(value)}</td></tr>'
        for label, value in rows.items()
        if value
    )
    return f'<table class="figures">{cells}</table>\n'


def _pictures(group: str, figures: Figures, shown: Shown) -> Iterable[str]:
    name = _text(figures["name"])
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
            yield (
                f'<figure><button type="button" data-kind="{kind}" '
                f'aria-label="Enlarge: {name}, {_text(caption)}">'
                f'<img src="data:image/png;base64,{data}" alt="{name}, {_text(caption)}">'
                f"</button><figcaption>{_text(caption)}</figcaption></figure>\n"
            )
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
    rows = "".join(
        f'<tr><th scope="row">{label}</th>'
        + "".join(f"<td>{value:.6g}</td>" for value in values)
        + "</tr>"
        for label, values in (
            ("expected", shown["worst_expected"]),
            ("actual", shown["worst_actual"]),
        )
    )
    crops = "".join(
        f'<figure><img class="crop" src="data:image/png;base64,{data}" '
        f'alt="around {place}: {kind}"><figcaption>{kind}</figcaption></figure>'
        for kind, data in shown["worst"].items()
    )
    x, y = shown["worst_at"] or (0, 0)
    return (
        f'<div class="worst"><h4>Worst pixel: {place}</h4>'
        f'<table class="figures">{rows}</table><div class="crops">{crops}</div>'
        f"<p>Its surroundings; it is pixel {x + 1} from the left, {y + 1} from the top.</p></div>\n"
    )


def _table(records: Sequence[Record], failed: Sequence[Record]) -> Iterable[str]:
    anchors = {id(record): f"check{index}" for index, record in enumerate(failed)}
    yield (
        '<section aria-labelledby="checks"><h2 id="checks">All checks</h2>\n<div class="wide">'
        '<table><thead><tr><th scope="col">Check</th><th scope="col">Result</th>'
        '<th scope="col">First to differ</th><th scope="col">Largest difference</th>'
        '<th scope="col">Test</th></tr></thead><tbody>\n'
    )
    for record in records:
        name = _text(record["name"])
        anchor = anchors.get(id(record))
        largest = max(
            (each["max_error"] or 0.0 for each in record["framebuffers"]), default=math.nan
        )
        yield (
            f'<tr class="{record["outcome"]}"><th scope="row">'
            + (f'<a href="#{anchor}">{name}</a>' if anchor else name)
            + f"</th><td>{_OUTCOMES[record['outcome']]}</td>"
            f"<td>{_text(record['first_failure'] or '')}</td>"
            f"<td>{'' if math.isnan(largest) else f'{largest:.4g}'}</td>"
            f"<td><code>{_text(record['test'])}</code></td></tr>\n"
        )
    yield "</tbody></table></div></section>\n"


def _number(value: float | None, unit: str = "") -> str:
    return "" if value is None else f"{value:.4g}{unit}"


def _text(value: object) -> str:
    return html.escape(str(value))
