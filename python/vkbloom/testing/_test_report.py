"""The report of a test run: one self-contained HTML page, and the same figures as JSON."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypedDict

import numpy as np
from numpy.typing import NDArray

from vkbloom._version import installed_version
from vkbloom._views import markup, pictures
from vkbloom._views.comparison import difference
from vkbloom._views.markup import Markup, element
from vkbloom._views.plain_values import plain
from vkbloom.testing._judging import Verdict

_FORMAT: Final = 1
_LARGEST_SIDE: Final = 640  # pixels of a picture in the page


class Record(TypedDict):
    """One check, as plain values that processes can exchange."""

    test: str
    name: str
    folder: str  # of the references
    outcome: str  # "passed", "failed", "missing" or "written"
    origin: str
    reference_origin: str | None
    first_failure: str | None
    message: str | None
    framebuffers: list[dict[str, Any]]
    part: str | None  # file with the pictures, in the folder of parts


def figures(verdict: Verdict, images: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Return a verdict's figures as plain values; None if a figure could not be computed."""
    image, measured = images.get(verdict.name), verdict.comparison
    outcome = "within" if verdict.passed else "failed"
    values = (measured and measured.max_error_values) or (None, None)
    names = ("max_error", "max_error_at", "mean_error", "percent_over", "ssim", "flip")
    return {
        "name": verdict.name,
        "outcome": "equal" if verdict.identical else outcome,
        "failed_at": verdict.failed_at,
        "reasons": list(verdict.reasons),
        "cause": verdict.diagnosis.summary if verdict.diagnosis else None,
        "shape": None if image is None else list(image.shape),
        "dtype": None if image is None else image.dtype.name,
        "atol": verdict.atol,
        "rtol": verdict.rtol,
        "expected_there": values[0],
        "actual_there": values[1],
        **{name: getattr(measured, name, None) for name in names},
    }


def write_part(
    folder: Path,
    verdicts: Sequence[Verdict],
    expected: Mapping[str, NDArray[Any]],
    actual: Mapping[str, NDArray[Any]],
) -> str:
    """Write the pictures of a failed check as HTML, and return the name of the new file.

    The process that ran the test writes them, because only this process has the images.
    """
    shown = [
        figure
        for verdict in verdicts
        if not verdict.passed
        for figure in _pictures(verdict, expected.get(verdict.name), actual.get(verdict.name))
    ]
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{os.urandom(8).hex()}.html"
    (folder / name).write_text(markup.joined(shown), encoding="utf-8")
    return name


def _pictures(
    verdict: Verdict, expected: NDArray[Any] | None, actual: NDArray[Any] | None
) -> Iterator[Markup]:
    """Yield a framebuffer as expected and as it is, and the difference."""
    for kind, image in (("expected", expected), ("actual", actual)):
        if image is not None:
            height, width = image.shape[:2]
            size = pictures.scaled(width, height, min(1.0, _LARGEST_SIDE / max(width, height)))
            yield _figure(pictures.picture(image, verdict.name, size=size), verdict.name, kind)
    if expected is not None and actual is not None and verdict.comparison is not None:
        differences, scale = difference(expected, actual)
        levels = np.rint(_peaks(differences) * 255).astype(np.uint8)
        yield _figure(levels, verdict.name, f"difference × {scale:.4g}")


def _figure(pixels: NDArray[np.uint8], name: str, kind: str) -> Markup:
    # Without alpha, so that no pixel is transparent.
    colours = np.ascontiguousarray(pixels[:, :, : 3 if pixels.shape[2] >= 3 else 1])
    caption = f"{name}, {kind}"
    return markup.figure(markup.image(pictures.png(colours), caption), caption)


def _peaks(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Reduce a picture to the page's size, keeping the largest value of each group of pixels."""
    side = math.ceil(max(values.shape[:2]) / _LARGEST_SIDE)
    for axis in (0, 1):
        values = np.maximum.reduceat(values, np.arange(0, values.shape[axis], side), axis=axis)
    return values


def write_report(folder: Path, parts: Path, records: Sequence[Record]) -> Path:
    """Write ``index.html`` and ``report.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    ordered = sorted(records, key=lambda record: (record["test"], record["name"]))
    checks = [{key: value for key, value in record.items() if key != "part"} for record in ordered]
    values = {"format": _FORMAT, "version": installed_version(), "checks": plain(checks)}
    (folder / "report.json").write_text(
        json.dumps(values, indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    page = folder / "index.html"
    page.write_text(_page(ordered, parts), encoding="utf-8")
    shutil.rmtree(parts, ignore_errors=True)
    return page


def _page(records: Iterable[Record], parts: Path) -> str:
    rows: list[tuple[object, ...]] = []
    failed: list[Markup] = []
    for record in records:
        name: object = record["name"]
        if record["message"]:
            anchor = f"check{len(failed)}"
            name = element("a", name, href=f"#{anchor}")
            failed.append(
                element(
                    "section",
                    element("h2", record["name"]),
                    element("p", element("code", record["test"])),
                    element("pre", record["message"]),
                    Markup((parts / record["part"]).read_text("utf-8") if record["part"] else ""),
                    id=anchor,
                )
            )
        first = record["first_failure"] or ""
        rows.append((name, record["outcome"], first, element("code", record["test"])))
    count = f"{len(rows)} check{'s' * (len(rows) != 1)}"
    title = f"{len(failed)} of {count} failed" if failed else f"{count} passed"
    table = markup.table(rows, ("check", "result", "first to differ", "test"))
    return markup.page(title, element("h1", title), table, *failed)
