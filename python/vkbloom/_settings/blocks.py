"""Settings as blocks of bytes: structs of the core, by the core's tables of their members."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from vkbloom import _core

if TYPE_CHECKING:
    from vkbloom._settings.glare import Glare

__all__ = ["settings_block"]

#: Members that are arrays of numbers, and the member that counts them, if there is one.
_COUNTS: Final[Mapping[str, str | None]] = {
    "weights": "weight_count",
    "layers": "layer_count",
    "level_weights": "level_weight_count",
    "tint": None,
    "sun_position": None,
}


def _defaults(
    table: Mapping[str, tuple[int, str, int]], values: Mapping[str, tuple[float, float, float]]
) -> np.ndarray[Any, Any]:
    """Return a struct whose numbers have their defaults."""
    rows = {name: row for name, row in table.items() if name}
    formats = [
        (np.dtype(code), (count,) if count > 1 else ())
        if code
        else (_STAGE.dtype, (count // _STAGE.dtype.itemsize,))
        for _, code, count in rows.values()
    ]
    offsets = [offset for offset, *_ in rows.values()]
    layout: Any = {
        "names": [*rows],
        "formats": formats,
        "offsets": offsets,
        "itemsize": table[""][2],
    }
    block = np.zeros((), np.dtype(layout))
    for name, (default, _, _) in values.items():
        block[name] = default
    return block


_STAGE: Final = _defaults(_core.STAGE_BLOCK, _core.GLARE_VALUES)
_SETTINGS: Final = _defaults(_core.SETTINGS_BLOCK, _core.VALUES)


def _index(name: str, value: object, names: Sequence[str]) -> int:
    if value not in names:
        raise ValueError(f"{name}: {value!r} is not one of {', '.join(names)}")
    return names.index(str(value))


def _store(block: Any, name: str, value: Any, table: Mapping[str, tuple[float, ...]]) -> None:
    """Store a number of a table; raise ValueError if it is out of its range."""
    _, low, high = table[name]
    if not low <= value <= high:
        raise ValueError(f"{name}: {value!r} is out of range, {low!r} to {high!r}")
    block[name] = value


def _store_array(block: Any, name: str, value: Any) -> None:
    rows = np.asarray(value, np.float64)
    numbers = rows.ravel()
    room = block[name].size
    if not 1 <= numbers.size <= room:
        raise ValueError(f"{name}: {numbers.size} numbers are out of range, 1 to {room}")
    if not (abs(numbers) <= np.finfo(np.float32).max).all():
        raise ValueError(f"{name}: {value!r} is out of range, finite numbers")
    block[name][: numbers.size] = numbers
    if counter := _COUNTS[name]:
        block[counter] = len(rows)


def _stage_block(stage: Glare) -> np.ndarray[Any, Any]:
    block = _copy(_STAGE)
    block["kind"] = _index("glare", stage.stage, _core.STAGES)
    for name in _core.GLARE_VALUES:
        if (value := getattr(stage, name, None)) is not None:
            _store(block, name, value, _core.GLARE_VALUES)
    ghosts = getattr(stage, "ghosts", ())
    numbers = np.array([(*tint, scale) for scale, tint in ghosts], np.float32).ravel()
    block["ghosts"][: numbers.size] = numbers
    block["ghost_count"] = len(ghosts)
    return block


def _copy(block: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return a copy, faster than NumPy, which copies member by member."""
    return np.ndarray((), block.dtype, bytearray(block.tobytes()))


def settings_block(method: str, fields: Mapping[str, Any]) -> bytes:
    """Return the block of a method with these fields; those that it lacks have their defaults.

    Raises ValueError or TypeError if the core has no room for a value.
    """
    block = _copy(_SETTINGS)
    block["method"] = _index("method", method, _core.METHODS)
    block["thresholded"] = fields.get("threshold") is not None
    for name, value in fields.items():
        if value is None:
            continue
        if name in _core.VALUES:
            _store(block, name, value, _core.VALUES)
        elif name in _core.CHOICES:
            block[name] = _index(name, value, _core.CHOICES[name])
        elif name in _COUNTS:
            _store_array(block, name, value)
        elif name == "bloom_size":
            block["bloom_width"], block["bloom_height"] = value
        elif name == "format":
            block["format"] = _index(name, value, _core.FORMATS)
    stages = fields.get("glare", ())
    if len(stages) > _core.MAX_STAGES:
        raise ValueError(f"glare: {len(stages)} stages are out of range, 0 to {_core.MAX_STAGES}")
    for place, stage in enumerate(stages):
        block["stages"][place] = _stage_block(stage)
    block["stage_count"] = len(stages)
    return block.tobytes()
