"""Parse the axes of a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import click
import numpy as np

import vkbloom
from vkbloom._cli import fields
from vkbloom._cli.program import as_wrong_use
from vkbloom._settings.fields import fields_of
from vkbloom._settings.settings import field_info
from vkbloom._suggestions import did_you_mean

_PRESETS: Final = fields.NameOf("preset", vkbloom.presets)
# Number of values of all axes together.
_MAX_VALUES: Final = 1_000_000


def axis_values(words: Sequence[str], settings: vkbloom.Settings) -> dict[str, Sequence[Any]]:
    """Return the values of each ``NAME=VALUES``."""
    begun = [settings]
    for word in words:
        if word.startswith("preset="):
            begun = [vkbloom.presets[value] for value in _values(word, _PRESETS, _MAX_VALUES)]
    results: dict[str, Sequence[Any]] = {}
    for word in words:
        name = word.partition("=")[0].strip().replace("-", "_")
        if name in results:
            raise click.UsageError(f"--axis: {name} is given twice; list all values in one")
        room = _MAX_VALUES - sum(map(len, results.values()))
        results[name] = _values(word, _type_of(name, begun), room)
    return results


def _type_of(name: str, begun: Sequence[vkbloom.Settings]) -> Any:
    """Return the type of a field's option, so that axes and options have one syntax."""
    if name in ("preset", "time"):
        return click.FLOAT if name == "time" else _PRESETS
    lacking = [settings for settings in begun if name not in fields_of(type(settings))]
    if lacking and not name.startswith("glare."):
        near = did_you_mean(name, fields_of(type(lacking[0])))
        raise click.UsageError(f"--axis: {lacking[0].method} has no field {name!r}{near}")
    with as_wrong_use():
        return fields.option_type(field_info(begun[0], name))


def _values(word: str, kind: Any, room: int) -> Sequence[Any]:
    text = word.partition("=")[2]
    values = [part.strip() for part in text.split(";" if ";" in text else ",") if part]
    if not values:
        raise click.UsageError(f"--axis: {word!r} is not NAME=FIRST:LAST:COUNT or NAME=A,B,...")
    try:
        if text.count(":") in (2, 3) and "," not in text and ";" not in text:
            return _range(text.split(":"), room)
        return [kind.convert(part, None, None) for part in values]
    except (click.BadParameter, ValueError) as error:
        hint = "; a range is FIRST:LAST:COUNT or FIRST:LAST:COUNT:log" if ":" in text else ""
        raise click.UsageError(f"--axis {word}: {error}{hint}") from error


def _range(parts: Sequence[str], room: int) -> list[float]:
    first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
    if not 1 <= count <= room:
        raise ValueError(f"count {count} is not in 1..{room}")
    if parts[3:] not in ([], ["log"]):
        raise ValueError(f"{parts[3]!r} is not log")
    if parts[3:] and not (first > 0 and last > 0):
        raise ValueError("FIRST and LAST are not both above 0, as :log needs")
    return [
        float(item) for item in (np.geomspace if parts[3:] else np.linspace)(first, last, count)
    ]
