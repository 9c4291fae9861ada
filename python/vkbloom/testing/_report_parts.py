"""One check in the report: figures of all framebuffers, and images of those that differ.

The process that ran the test writes these parts, because only this process has the images.
"""

from __future__ import annotations

import base64
import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypedDict

import numpy as np
from numpy.typing import NDArray

from vkbloom._views import pictures
from vkbloom._views.comparison import difference, flip_map
from vkbloom.testing._judging import Verdict
from vkbloom.testing._records import Figures

__all__ = ["Histogram", "Part", "Shown", "figures", "write"]

_LARGEST_SIDE: Final = 960  # pixels of a picture in the report
_BINS: Final = 41  # of a histogram; odd, so that one of them is around 0
_AROUND: Final = 8  # pixels to each side of the worst one
# OpenImageIO's FLIP takes about 2 microseconds per float pixel; larger maps would delay a run.
_LARGEST_FLIP: Final = 1 << 22

# Five colours of matplotlib's magma from 0 to 1; FLIP's own tool uses this colour map.
_MAGMA: Final = np.array(
    [(0, 0, 4), (81, 18, 124), (183, 55, 121), (252, 137, 97), (252, 253, 191)], np.float32
)


class Histogram(TypedDict):
    """Counts of differences, actual minus expected."""

    low: float
    high: float
    counts: list[int]


class Shown(TypedDict):
    """One framebuffer; pictures are PNG files in base64, or None."""

    name: str
    expected: str | None
    actual: str | None
    difference: str | None
    magnified: float  # factor of the differences
    shrunk: bool  # pictures are smaller than the framebuffer
    flip: str | None
    flip_note: str | None  # reason for a missing map
    flip_mean: float | None
    histogram: Histogram | None
    worst: dict[str, str]  # surroundings of the worst pixel by kind of picture
    worst_at: list[int] | None  # its x and y in these images
    worst_expected: list[float]  # its channels
    worst_actual: list[float]


Part = list[Shown]


def figures(verdict: Verdict, images: Mapping[str, NDArray[Any]]) -> Figures:
    """Return a verdict's figures as plain values."""
    image = images.get(verdict.name)
    found = verdict.comparison
    outcome = "within" if verdict.passed else "failed"
    values = found.max_error_values if found else None
    return {
        "name": verdict.name,
        "outcome": "equal" if verdict.identical else outcome,
        "failed_at": verdict.failed_at,
        "reasons": list(verdict.reasons),
        "cause": verdict.diagnosis.summary if verdict.diagnosis else None,
        "shape": list(image.shape) if image is not None else None,
        "dtype": image.dtype.name if image is not None else None,
        "atol": verdict.atol,
        "rtol": verdict.rtol,
        "max_error": found.max_error if found else None,
        "max_error_at": list(found.max_error_at) if found and found.max_error_at else None,
        "expected_there": values[0] if values else None,
        "actual_there": values[1] if values else None,
        "mean_error": found.mean_error if found else None,
        "percent_over": found.percent_over if found else None,
        "ssim": found.ssim if found else None,
        "flip": found.flip if found else None,
    }


def write(
    folder: Path,
    verdicts: tuple[Verdict, ...],
    expected: Mapping[str, NDArray[Any]],
    actual: Mapping[str, NDArray[Any]],
) -> str:
    """Write the pictures of a check to a new file."""
    part = [
        _shown(verdict, expected.get(verdict.name), actual.get(verdict.name))
        for verdict in verdicts
    ]
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{os.urandom(8).hex()}.json"
    (folder / name).write_text(json.dumps(part), encoding="utf-8")
    return name


def _shown(verdict: Verdict, expected: NDArray[Any] | None, actual: NDArray[Any] | None) -> Shown:
    shown: Shown = {
        "name": verdict.name,
        "expected": None if verdict.identical else _picture(verdict.name, expected, expected),
        "actual": _picture(verdict.name, actual, expected),
        "difference": None,
        "magnified": 1.0,
        "shrunk": any(
            image is not None and max(image.shape[:2]) > _LARGEST_SIDE
            for image in (expected, actual)
        ),
        "flip": None,
        "flip_note": None,
        "flip_mean": None,
        "histogram": None,
        "worst": {},
        "worst_at": None,
        "worst_expected": [],
        "worst_actual": [],
    }
    if expected is None or actual is None or verdict.comparison is None or verdict.identical:
        return shown
    differences, shown["magnified"] = difference(expected, actual)
    shown["difference"] = _encoded(_levels(_peaks(differences)))
    _add_flip(shown, expected, actual)
    shown["histogram"] = _histogram(expected, actual)
    if verdict.comparison.max_error_at is not None:
        x, y, _ = verdict.comparison.max_error_at
        _add_worst(shown, (expected, actual, differences), x, y)
    return shown


def _add_flip(shown: Shown, expected: NDArray[Any], actual: NDArray[Any]) -> None:
    if expected.shape[0] * expected.shape[1] > _LARGEST_FLIP:
        shown["flip_note"] = f"not computed for more than {_LARGEST_FLIP} pixels"
        return
    try:
        found = flip_map(expected, actual)
    except ModuleNotFoundError as error:
        shown["flip_note"] = str(error)
        return
    mean = float(found.mean(dtype=np.float64))
    if not math.isfinite(mean):
        shown["flip_note"] = "the values are too large"
        return
    shown["flip_mean"] = mean
    place = np.clip(_peaks(found[:, :, np.newaxis])[:, :, 0], 0, 1) * (len(_MAGMA) - 1)
    lower = np.minimum(place.astype(np.intp), len(_MAGMA) - 2)
    part = (place - lower)[:, :, np.newaxis]
    colours = _MAGMA[lower] * (1 - part) + _MAGMA[lower + 1] * part
    shown["flip"] = _encoded(np.rint(colours).astype(np.uint8))


def _histogram(expected: NDArray[Any], actual: NDArray[Any]) -> Histogram | None:
    real = [_real(image) for image in (expected, actual)]
    with np.errstate(over="ignore", invalid="ignore"):
        differences = real[1] - real[0]
    differences = differences[np.isfinite(differences)]
    largest = float(np.abs(differences).max(initial=0.0))
    if not 0 < largest < np.finfo(np.float64).max / 4:
        return None
    counts, _ = np.histogram(differences, _BINS, (-largest, largest))
    return {"low": -largest, "high": largest, "counts": [int(count) for count in counts]}


def _add_worst(
    shown: Shown, images: tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]], x: int, y: int
) -> None:
    expected, actual, differences = images
    left, top = max(x - _AROUND, 0), max(y - _AROUND, 0)
    window = (slice(top, y + _AROUND + 1), slice(left, x + _AROUND + 1))
    # Stretched by the range of the complete picture, so that the colours are the same.
    shown["worst"] = {
        "expected": _encoded(_colours(pictures.picture(expected, shown["name"]))[window]),
        "actual": _encoded(
            _colours(pictures.picture(actual, shown["name"], range_of=expected))[window]
        ),
        "difference": _encoded(_levels(differences[window])),
    }
    shown["worst_at"] = [x - left, y - top]
    shown["worst_expected"] = _channels(expected, x, y)
    shown["worst_actual"] = _channels(actual, x, y)


def _channels(image: NDArray[Any], x: int, y: int) -> list[float]:
    """Return a pixel's channels in real units."""
    return [float(value) for value in np.atleast_1d(_real(image)[y, x])]


def _picture(name: str, image: NDArray[Any] | None, range_of: NDArray[Any] | None) -> str | None:
    if image is None:
        return None
    height, width = image.shape[:2]
    shrink = min(1.0, _LARGEST_SIDE / max(width, height))
    size = (max(1, round(width * shrink)), max(1, round(height * shrink)))
    if range_of is not None and range_of.shape != image.shape:
        range_of = None
    return _encoded(_colours(pictures.picture(image, name, size=size, range_of=range_of)))


def _colours(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Remove alpha, so that no pixel is transparent."""
    return pixels[:, :, : 3 if pixels.shape[2] >= 3 else 1]


def _peaks(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Reduce a picture to the report's size, keeping the largest value of each group of pixels."""
    shrink = max(1.0, max(values.shape[:2]) / _LARGEST_SIDE)
    for axis in (0, 1):
        count = values.shape[axis]
        wanted = max(1, round(count / shrink))
        if wanted < count:
            starts = np.arange(wanted) * count // wanted
            values = np.maximum.reduceat(values, starts, axis=axis)
    return values


def _levels(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    levels: NDArray[np.uint8] = np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)
    return levels


def _real(image: NDArray[Any]) -> NDArray[np.float64]:
    values = image.astype(np.float64)
    return values / np.iinfo(image.dtype).max if image.dtype.kind == "u" else values


def _encoded(pixels: NDArray[np.uint8]) -> str:
    return base64.b64encode(pictures.png(np.ascontiguousarray(pixels))).decode("ascii")
