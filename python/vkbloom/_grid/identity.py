"""The identity of a stored grid, and the differences between two identities."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from vkbloom._grid.layout import Grid, Layout
from vkbloom._grid.order import Index
from vkbloom._settings.fields import plain_value

#: Version of the store's layout. A store with another version cannot be read.
FORMAT: Final = 3

_LONGEST: Final = 60  # characters of a value in a message


def identity(grid: Grid, layout: Layout, chunk: Index) -> dict[str, Any]:
    """Return everything that determines the contents of a grid's arrays, as JSON values."""
    facts = {
        "format": FORMAT,
        "version": layout.version,
        "adapter": layout.adapter,
        "driver": layout.driver,
        "source": grid.source.description,
        "settings": grid.remaining_settings,
        "axes": {axis.name: [plain_value(value) for value in axis.values] for axis in grid.axes},
        "order of axes": [axis.name for axis in grid.axes],
        "variables": {
            name: {"shape": variable.shape, "dtype": variable.dtype.name}
            for name, variable in layout.variables.items()
        },
        "reduce": {name: _named(reduction) for name, reduction in grid.reduce.items()},
        "chunk": chunk,
    }
    # The same conversion as by storing it in JSON, which turns tuples into lists.
    plain: dict[str, Any] = json.loads(json.dumps(facts))
    return plain


def chunk_in(stored: Mapping[str, Any], shape: Index) -> Index | None:
    """Return the chunk of a stored identity; None if it is not valid for the grid's shape.

    The identity may be damaged, so any value is possible.
    """
    held = stored.get("chunk")
    if stored.get("format") != FORMAT or not isinstance(held, list) or len(held) != len(shape):
        return None
    for count, size in zip(held, shape, strict=True):
        if type(count) is not int or not 1 <= count <= max(size, 1):
            return None
    return tuple(held)


def _named(reduction: Any) -> str:
    kind = reduction if hasattr(reduction, "__qualname__") else type(reduction)
    return f"{kind.__module__}.{kind.__qualname__}"


def differences(stored: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """List the differences between the grid in a store and the requested one."""
    return list(_differences("", stored, asked))


def _differences(name: str, stored: Any, asked: Any) -> Iterator[str]:
    if isinstance(stored, Mapping) and isinstance(asked, Mapping):
        for key in dict.fromkeys((*stored, *asked)):
            inner = f"{name}.{key}" if name else key
            if key not in stored:
                yield f"{inner}: not in the store, {short(asked[key])} requested"
            elif key not in asked:
                yield f"{inner}: {short(stored[key])} in the store, not requested"
            else:
                yield from _differences(inner, stored[key], asked[key])
    elif stored != asked:
        yield f"{name}: {short(stored)} in the store, {short(asked)} requested"


def short(value: Any) -> str:
    """Return any JSON value as a short text for a message."""
    text = json.dumps(value)
    if len(text) <= _LONGEST:
        return text
    return f"{text[: _LONGEST - 20]} ... {text[-12:]}"
