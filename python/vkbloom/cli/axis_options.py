"""Parse the axes, chunks and reductions of a grid from options and option files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import click
import numpy as np

import vkbloom
from vkbloom import reductions
from vkbloom.cli import fields
from vkbloom.cli.image_files import read
from vkbloom.cli.program import as_wrong_use
from vkbloom.fields import FieldInfo, fields_of
from vkbloom.settings import field_info
from vkbloom.suggestions import did_you_mean

__all__ = ["REDUCTIONS", "axis_bounds", "axis_values", "chunk_counts", "named_reductions"]

REDUCTIONS: Final[Mapping[str, type[reductions.Reduction]]] = {
    "mean": reductions.Mean,
    "max": reductions.Max,
    "encircled_energy": reductions.EncircledEnergy,
    "ssim": reductions.SSIM,
    "psnr": reductions.PSNR,
    "flip": reductions.FLIP,
}

_PRESET: Final = "preset"
_PRESETS: Final = fields.NameOf(_PRESET, vkbloom.presets)
_RANGE_PARTS: Final = (3, 4)
_MOST_DIGITS: Final = 18
# Number of values of all axes together.
_MOST_VALUES: Final = 1_000_000


def axis_values(words: Sequence[str], settings: vkbloom.Settings) -> dict[str, Sequence[Any]]:
    """Return the values of each ``NAME=VALUES``.

    `words`: ``NAME=FIRST:LAST:COUNT`` (evenly spaced, both ends included), the same with ``:log``
    (logarithmically spaced), or ``NAME=VALUE,VALUE,...``. Values that contain commas are separated
    by semicolons. The NAME "preset" has names of `vkbloom.presets`.
    """
    types = _types_of([settings])
    lacking = f"the method {settings.method} has no field"
    for word in words:
        name, _, text = word.partition("=")
        if name.strip() == _PRESET:
            named = [vkbloom.presets[_converted(_PRESETS, word, one)] for one in text.split(",")]
            types = {**_types_of(named), _PRESET: _PRESETS}
            lacking = "not all of these presets have the field"
    found: dict[str, Sequence[Any]] = {}
    for word in words:
        name, sign, text = word.partition("=")
        name = name.strip().replace("-", "_")
        if name.startswith("glare."):
            with as_wrong_use():
                types[name] = _type_of(field_info(settings, name))
        if not sign or not text:
            raise click.UsageError(f"--axis: {word!r} is not NAME=FIRST:LAST:COUNT or NAME=A,B,...")
        if name not in types:
            raise click.UsageError(f"--axis: {lacking} {name!r}{did_you_mean(name, types)}")
        if name in found:
            raise click.UsageError(f"--axis: {name} is given twice; list all values in one")
        room = _MOST_VALUES - sum(map(len, found.values()))
        found[name] = _values(word, text, types[name], room)
    return found


def _type_of(info: FieldInfo) -> click.ParamType[Any] | None:
    """Return the type of a field's option, so that axes and options have one syntax."""
    try:
        return fields.option_type(info)
    except TypeError:
        return None


def _types_of(settings: Sequence[vkbloom.Settings]) -> dict[str, click.ParamType[Any] | None]:
    """Return the types of the time and of the fields that all settings have."""
    first, *others = (fields_of(type(one)) for one in settings)
    shared = {name: info for name, info in first.items() if all(name in one for one in others)}
    return {"time": click.FLOAT, **{name: _type_of(info) for name, info in shared.items()}}


def _values(word: str, text: str, kind: click.ParamType[Any] | None, room: int) -> Sequence[Any]:
    parts = text.split(":")
    if len(parts) in _RANGE_PARTS and "," not in text and ";" not in text:
        return _range(word, parts, room)
    values = [part for part in text.split(";" if ";" in text else ",") if part]
    if not values:
        raise click.UsageError(f"--axis {word}: there are no values; give at least one")
    if kind is None:
        raise click.UsageError(
            f"--axis {word}: values of this field cannot be written here; use Renderer.grid"
        )
    return [_converted(kind, word, part) for part in values]


def _converted(kind: click.ParamType[Any], word: str, part: str) -> Any:
    """Return one value of the axis `word`, or raise click.UsageError."""
    try:
        return kind.convert(part.strip(), None, None)
    except click.BadParameter as error:
        hint = "; a range is FIRST:LAST:COUNT" if ":" in part else ""
        raise click.UsageError(f"--axis {word}: {error.message}{hint}") from error


def _range(word: str, parts: Sequence[str], room: int) -> Sequence[float]:
    try:
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        is_log = len(parts) > 3
        if is_log and parts[3] != "log":
            raise ValueError
    except ValueError:
        raise click.UsageError(
            f"--axis: {word!r} is not NAME=FIRST:LAST:COUNT or NAME=FIRST:LAST:COUNT:log"
        ) from None
    if not 1 <= count <= room:
        raise click.UsageError(f"--axis {word}: count {count} is not in 1..{room}")
    if is_log and not (first > 0 and last > 0):
        raise click.UsageError(f"--axis {word}: FIRST and LAST are not both above 0, as :log needs")
    spread = np.geomspace if is_log else np.linspace
    return [float(value) for value in spread(first, last, count)]


def axis_bounds(words: Sequence[str]) -> dict[str, Sequence[Any]]:
    """Parse each ``NAME=LOW:HIGH``, or ``NAME=A,B`` for choices, into the bounds of a fit."""
    found: dict[str, Sequence[Any]] = {}
    for word in words:
        name, sign, text = word.partition("=")
        low, colon, high = text.partition(":")
        try:
            values: Sequence[Any] = (float(low), float(high)) if colon else text.split(",")
        except ValueError:
            sign = ""
        if not sign or not text:
            raise click.UsageError(f"--bounds: {word!r} is not NAME=LOW:HIGH or NAME=A,B,...")
        found[name.strip().replace("-", "_")] = values
    return found


def chunk_counts(words: Sequence[str]) -> dict[str, int] | None:
    """Parse each ``NAME=COUNT`` into grid points per chunk by axis; None if there are none."""
    found = {}
    for word in words:
        name, _, count = word.partition("=")
        if not count.isdecimal() or len(count) > _MOST_DIGITS:
            raise click.UsageError(f"--chunk: {word!r} is not AXIS=COUNT")
        found[name.replace("-", "_")] = int(count)
    return found or None


def named_reductions(
    words: Sequence[str], settings: vkbloom.Settings
) -> dict[str, reductions.Reduction]:
    """Parse each ``[NAME=]KIND[:FRAMEBUFFER][@REFERENCE]`` into a reduction."""
    found: dict[str, reductions.Reduction] = {}
    for word in words:
        head, _, reference = word.partition("@")
        name, sign, described = head.partition("=")
        described = described if sign else name
        kind, _, attachment = described.partition(":")
        if kind not in REDUCTIONS:
            raise click.UsageError(
                f"--reduce {word}: {kind!r} is not one of {', '.join(REDUCTIONS)}"
                f"{did_you_mean(kind, REDUCTIONS)}"
            )
        arguments: dict[str, Any] = {"attachment": attachment} if attachment else {}
        is_comparing = issubclass(REDUCTIONS[kind], reductions.Comparing)
        if is_comparing != bool(reference):
            needed = "needs @REFERENCE" if is_comparing else "takes no @REFERENCE"
            raise click.UsageError(f"--reduce {word}: {kind} {needed}")
        if "=" in reference:
            values = axis_values(reference.split(","), settings)
            arguments["against"] = {axis: value[0] for axis, value in values.items()}
        elif reference:
            stored = read(reference, 0)
            if len(stored.parts) > 1:
                raise click.UsageError(
                    f"--reduce {word}: {reference} has several parts; give a file with one"
                )
            arguments["against"] = stored.pixels
        with as_wrong_use():
            found[name if sign else kind] = REDUCTIONS[kind](**arguments)
    return found
