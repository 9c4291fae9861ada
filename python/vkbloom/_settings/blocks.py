"""Settings as blocks of bytes: structs of the core, by the core's tables of their members."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from vkbloom import _core
from vkbloom._formats import MAX_FLOAT

if TYPE_CHECKING:
    from vkbloom._settings.glare import Glare

Table = Mapping[str, tuple[int, str, int]]
Values = Mapping[str, tuple[float, float, float]]

#: The codes of the tables as those of the module struct.
_CODES: Final = {"f4": "f", "f8": "d", "i4": "i", "u4": "I"}


#: What packs single numbers.
_PACK: Final = {code: struct.Struct(f"={letter}").pack_into for code, letter in _CODES.items()}


def _pack(block: bytearray, table: Table, name: str, *numbers: float) -> None:
    offset, code, _ = table[name]
    if len(numbers) == 1:
        _PACK[code](block, offset, *numbers)
    else:
        struct.pack_into(f"={len(numbers)}{_CODES[code]}", block, offset, *numbers)


def _defaults(table: Table, values: Values) -> bytes:
    """Return a struct whose numbers have their defaults, and whose rest is 0."""
    block = bytearray(table[""][2])
    for name, (default, _, _) in values.items():
        _pack(block, table, name, default)
    return bytes(block)


_STAGE: Final = _defaults(_core.STAGE_BLOCK, _core.GLARE_VALUES)
_SETTINGS: Final = _defaults(_core.SETTINGS_BLOCK, _core.VALUES)

#: What stores the value of a member in a block. ValueError: the core has no room for it.
_Store = Callable[[bytearray, Any], None]


def _index(name: str, value: object, names: Sequence[str]) -> int:
    if value not in names:
        raise ValueError(f"{name}: {value!r} is not one of {', '.join(names)}")
    return names.index(str(value))


def _store_value(table: Table, values: Values, name: str) -> _Store:
    (default, low, high), (offset, code, _) = values[name], table[name]
    pack, is_count = _PACK[code], code == "i4"

    def store(block: bytearray, value: float) -> None:
        # The block has it.
        if value == default:
            return
        if not low <= value <= high:
            raise ValueError(f"{name}: {value!r} is out of range, {low!r} to {high!r}")
        pack(block, offset, int(value) if is_count else value)

    return store


def _store_choice(name: str, names: Sequence[str]) -> _Store:
    offset, code, _ = _core.SETTINGS_BLOCK[name]
    pack, indices = _PACK[code], {each: index for index, each in enumerate(names)}

    def store(block: bytearray, value: str) -> None:
        index = indices.get(value)
        pack(block, offset, _index(name, value, names) if index is None else index)

    return store


# Settings that a loop replaces have the same arrays.
@functools.lru_cache(64)
def _array_bytes(name: str, value: tuple[Any, ...]) -> tuple[bytes, int]:
    """Return an array's numbers as a block has them, and the number of rows."""
    _, code, room = _core.SETTINGS_BLOCK[name]
    rows = [row if isinstance(row, tuple) else (row,) for row in value]
    numbers = [float(number) for row in rows for number in row]
    if not 1 <= len(numbers) <= room:
        raise ValueError(f"{name}: {len(numbers)} numbers are out of range, 1 to {room}")
    if not all(abs(number) <= MAX_FLOAT for number in numbers):
        raise ValueError(f"{name}: {value!r} is out of range, finite numbers")
    return struct.pack(f"={len(numbers)}{_CODES[code]}", *numbers), len(rows)


def _store_array(name: str) -> _Store:
    start = _core.SETTINGS_BLOCK[name][0]
    # The member that counts the rows, if there is one: "weight_count" of "weights".
    counter = f"{name.removesuffix('s')}_count"

    def store(block: bytearray, value: Sequence[Any]) -> None:
        packed, rows = _array_bytes(name, tuple(value))
        block[start : start + len(packed)] = packed
        if counter in _core.SETTINGS_BLOCK:
            _pack(block, _core.SETTINGS_BLOCK, counter, rows)

    return store


def _store_size(block: bytearray, size: tuple[int, int]) -> None:
    width, height = size
    if not all(1 <= side < 1 << 32 for side in size):
        raise ValueError(f"bloom_size: {size!r} is out of range, sides of at least 1")
    _pack(block, _core.SETTINGS_BLOCK, "bloom_width", width)
    _pack(block, _core.SETTINGS_BLOCK, "bloom_height", height)


#: By field. A training loop makes a block in each step, and a request with new settings, too: from
#: branches by kind a block of `Separable` took 11 us in place of 8 (2026-11-30).
_STORES: Final[Mapping[str, _Store]] = {
    **{
        name: _store_array(name)
        for name, (_, code, count) in _core.SETTINGS_BLOCK.items()
        if code in _CODES and count > 1
    },
    "bloom_size": _store_size,
    "format": _store_choice("format", _core.FORMATS),
    **{name: _store_choice(name, names) for name, names in _core.CHOICES.items()},
    **{name: _store_value(_core.SETTINGS_BLOCK, _core.VALUES, name) for name in _core.VALUES},
}
_STAGE_STORES: Final[Mapping[str, _Store]] = {
    name: _store_value(_core.STAGE_BLOCK, _core.GLARE_VALUES, name) for name in _core.GLARE_VALUES
}


def _stage_block(stage: Glare) -> bytearray:
    table, block = _core.STAGE_BLOCK, bytearray(_STAGE)
    _pack(block, table, "kind", _index("glare", stage.stage, _core.STAGES))
    for name, store in _STAGE_STORES.items():
        if (value := getattr(stage, name, None)) is not None:
            store(block, value)
    numbers = [n for scale, tint in getattr(stage, "ghosts", ()) for n in (*tint, scale)]
    if len(numbers) > table["ghosts"][2]:
        raise ValueError(
            f"ghosts: {len(numbers) // 4} ghosts are out of range, 0 to {_core.MAX_GHOSTS}"
        )
    _pack(block, table, "ghosts", *numbers)
    _pack(block, table, "ghost_count", len(numbers) // 4)
    return block


def exposure_block(
    settings: bytes, engine: str, numbers: Mapping[str, float], values: Sequence[float]
) -> bytes:
    """Return the block of settings with an exposure; `values` is its table."""
    table, block = _core.SETTINGS_BLOCK, bytearray(settings)
    ordered = [numbers.get(name, 0.0) for name in _core.EXPOSURE_NUMBERS]
    if unknown := set(numbers) - set(_core.EXPOSURE_NUMBERS):
        raise ValueError(f"exposure: the core has no {', '.join(sorted(unknown))}")
    if len(values) > table["exposure_table"][2]:
        raise ValueError(f"exposure: a table of {len(values)} numbers is too long")
    _pack(block, table, "exposure_engine", _index("exposure", engine, _core.EXPOSURES))
    _pack(block, table, "exposure_numbers", *ordered)
    _pack(block, table, "exposure_table", *values)
    _pack(block, table, "exposure_key_count", len(values) // 2)
    return bytes(block)


def antialiasing_block(
    settings: bytes,
    engine: str,
    numbers: Mapping[str, float],
    weights: Sequence[Sequence[float]],
    *,
    after: bool,
) -> bytes:
    """Return the block of settings with temporal anti-aliasing; `weights` has a row a phase."""
    table, block = _core.SETTINGS_BLOCK, bytearray(settings)
    if unknown := set(numbers) - set(_core.TAA_NUMBERS):
        raise ValueError(f"taa: the core has no {', '.join(sorted(unknown))}")
    if len(weights) > _core.TAA_PHASES:
        raise ValueError(f"taa: {len(weights)} phases are out of range, 1 to {_core.TAA_PHASES}")
    given = {**numbers, "phases": max(1, len(weights))}
    _pack(block, table, "taa_engine", _index("taa", engine, _core.TAAS))
    _pack(block, table, "taa_after", after)
    _pack(block, table, "taa_numbers", *(given.get(name, 0.0) for name in _core.TAA_NUMBERS))
    # A row has 9 numbers, and begins at a multiple of 12.
    padded = [number for row in weights for number in (*row, 0.0, 0.0, 0.0)]
    _pack(block, table, "taa_weights", *padded)
    return bytes(block)


def settings_block(method: str, fields: Mapping[str, Any]) -> bytes:
    """Return the block of a method with these fields; those that it lacks have their defaults.

    Raises ValueError or TypeError if the core has no room for a value.
    """
    table, block = _core.SETTINGS_BLOCK, bytearray(_SETTINGS)
    _pack(block, table, "method", _index("method", method, _core.METHODS))
    _pack(block, table, "thresholded", fields.get("threshold") is not None)
    for name, value in fields.items():
        if value is not None and (store := _STORES.get(name)):
            store(block, value)
    stages = [_stage_block(stage) for stage in fields.get("glare", ())]
    if len(stages) > _core.MAX_STAGES:
        raise ValueError(f"glare: {len(stages)} stages are out of range, 0 to {_core.MAX_STAGES}")
    start, size = table["stages"][0], len(_STAGE)
    block[start : start + size * len(stages)] = b"".join(stages)
    _pack(block, table, "stage_count", len(stages))
    return bytes(block)
