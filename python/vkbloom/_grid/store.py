"""A grid in a Zarr store, which xarray can open at any time.

The process may be killed at any time, because it writes in this order:

1. The group's metadata, with the identity of the grid and a copy of the arrays' metadata. They
   are created only where there are none: of processes with different grids, one writes, and the
   others are refused.
2. The arrays' metadata, and the coordinates.
3. Blocks of points: a complete chunk of each variable, with a checksum. Zarr's LocalStore writes
   a key to a temporary file first and renames it.
4. The blocks' chunks of ``done``, after the blocks have been flushed to the disk.

``done`` has the same chunks as the variables. So a process writes only keys of its own blocks, and
processes with different parts need no lock: they write the same metadata.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from vkbloom._checks import import_extra
from vkbloom._grid.chunks import DONE, Chunks
from vkbloom._grid.identity import FORMAT, differences, identity, short
from vkbloom._grid.keys import Keys
from vkbloom._grid.layout import Grid, Layout, Variable, attributes_of
from vkbloom._grid.order import WHOLE, Block, Index, Part, blocks

METADATA: Final = "zarr.json"
IDENTITY: Final = "vkbloom_grid"

_PURPOSE: Final = "Grids on disk"
# Level 1 is fast; on noisy pictures higher levels compress little better.
_ZSTD_LEVEL: Final = 1
# The separator "." puts all chunks of an array in one folder; "/" would nest a folder per axis.
_KEYS: Final = {"name": "default", "separator": "."}


def expected_keys(grid: Grid, layout: Layout, chunk: Index) -> dict[str, bytes]:
    """Return the contents of a store before its first block, the group's metadata first."""
    zarr = import_extra("zarr", "grid", _PURPOSE)
    held: dict[str, Any] = {}
    memory = zarr.storage.MemoryStore(held)
    own = identity(grid, layout, chunk)
    # (As text: netCDF stores no mappings.)
    attributes = {**attributes_of(grid, layout), IDENTITY: json.dumps(own)}
    group = zarr.open_group(memory, mode="w", zarr_format=3, attributes=attributes)
    coordinates = {axis.name: (axis.coordinate, axis.attributes) for axis in grid.axes}
    for name, (values, attrs) in {**coordinates, **layout.coordinates}.items():
        lone = Variable((name,), (), values.dtype, attrs)
        array = _add_array(group, name, values.shape, values.shape, lone)
        array[...] = values.astype(object) if values.dtype.kind == "U" else values
    facts = {"description": "Whether the point is done"}
    done = Variable((), (), np.dtype(np.bool_), facts)
    dims = tuple(axis.name for axis in grid.axes)
    for name, variable in {DONE: done, **layout.variables}.items():
        spread = replace(variable, dims=(*dims, *variable.dims))
        shape, chunks = ((*counts, *variable.shape) for counts in (grid.shape, chunk))
        _add_array(group, name, shape, chunks, spread)
    with warnings.catch_warnings():
        # Zarr warns because format 3 does not define consolidated metadata; xarray reads them.
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(memory)
    names = sorted(held, key=lambda key: (key != METADATA, key))
    return {key: bytes(held[key].to_bytes()) for key in names}


def _add_array(group: Any, name: str, shape: Index, chunk: Index, variable: Variable) -> Any:
    """Add an array without its chunks to a Zarr group."""
    codecs = import_extra("zarr.codecs", "grid", _PURPOSE)
    is_text = variable.dtype.kind == "U"
    # The checksum is the last codec, so that it covers the compressed bytes.
    compressors = [codecs.ZstdCodec(level=_ZSTD_LEVEL), codecs.Crc32cCodec()]
    return group.create_array(
        name,
        shape=shape,
        chunks=chunk,
        dtype=str if is_text else variable.dtype,
        dimension_names=variable.dims,
        attributes=dict(variable.attributes),
        chunk_key_encoding=_KEYS,
        config={"write_empty_chunks": True},
        # Marks are too small for a compression, which zarr runs in a thread.
        compressors=compressors[name == DONE :],
        fill_value={"f": math.nan, "U": ""}.get(variable.dtype.kind, 0),
    )


class GridStore:
    """The Zarr store of a grid, with its marks of completed points."""

    def __init__(
        self, keys: Keys, grid: Grid, layout: Layout, chunk: Index, part: Part = WHOLE
    ) -> None:
        self.keys = keys
        self.part = part
        self.grid = grid
        self.layout = layout
        self.chunk = chunk
        self.done = np.zeros(grid.shape, np.bool_)
        trailing = {name: len(v.shape) for name, v in layout.variables.items()}
        self._chunks = Chunks(keys, trailing, chunk)

    @property
    def writer(self) -> Chunks:
        """The writer of blocks, which can be sent to other processes."""
        return self._chunks

    def blocks(self) -> Iterable[Block]:
        """Return the blocks of the part in the order in which they are rendered."""
        return blocks(self.grid.shape, self.chunk, self.layout.ranking, self.part)

    @property
    def total(self) -> int:
        """Number of points of the part."""
        if self.part == WHOLE:
            return self.done.size
        return sum(block.count for block in self.blocks())

    def missing(self) -> Iterable[Block]:
        """Return the blocks that are not done, in the order in which they are rendered."""
        return (block for block in self.blocks() if not self.done[block.slices].all())

    def mark(self, written: Iterable[Block]) -> None:
        """Mark points as done; their data must be on the disk."""
        marked = list(written)
        self._chunks.mark(marked)
        for block in marked:
            self.done[block.slices] = True

    def prepare(self, *, resume: bool) -> None:
        """Create the store, or examine an existing one and replace damaged metadata of arrays.

        FileExistsError: the store exists and `resume` is False. ValueError: it contains other data
        or another grid; nothing is written.
        """
        expected = expected_keys(self.grid, self.layout, self.chunk)
        held = self.keys.all()
        if held and not resume:
            raise FileExistsError(
                f"{self.keys.name}: the store already has a grid; resume it, or name another store"
            )
        if not held:
            # Of processes that start at once, one decides which grid this is.
            self.keys.create(METADATA, expected[METADATA])
        stored = checked_identity(self.keys)
        changed = differences(stored, identity(self.grid, self.layout, self.chunk))
        if changed:
            raise ValueError(f"{self.keys.name}: contains another grid; {'; '.join(changed)}")
        if self.part == WHOLE:
            self.keys.remove_leftovers()
        for key, content in expected.items():
            if self.keys.read(key) != content:
                self.keys.write(key, content)
        self.keys.flush(expected)
        self._mark_complete(held)

    def _mark_complete(self, held: set[str]) -> None:
        """Mark the completed points, and remove the marks of damaged ones."""
        unmarked = []
        for block in self.blocks() if held else ():
            marked = self._chunks.marked(block, held)
            problems = (self._chunks.problem(name, block, held) for name in self.layout.variables)
            is_complete = not any(problems)
            self.done[block.slices] = is_complete
            if is_complete and marked is not True:
                # A complete block without a mark was written just before the process ended.
                unmarked.append(block)
            elif marked and not is_complete:
                self.keys.remove(self._chunks.key(DONE, block))
        self._chunks.mark(unmarked)


def stored_identity(keys: Keys) -> dict[str, Any] | None:
    """Return the grid's identity from the group's metadata; None if there is none."""
    try:
        held = json.loads(json.loads(keys.read(METADATA) or b"")["attributes"][IDENTITY])
    except (KeyError, TypeError, ValueError, RecursionError):
        return None
    return held if isinstance(held, dict) else None


def checked_identity(keys: Keys) -> dict[str, Any]:
    """Return the grid's identity, or raise ValueError if there is none of this version."""
    held = stored_identity(keys)
    if held is None:
        raise ValueError(
            f"{keys.name}: its content is not a grid of vkbloom, or its {METADATA} is damaged"
        )
    version = held.get("format")
    if version != FORMAT:
        raise ValueError(f"{keys.name}: its format version {short(version)} is not {FORMAT}")
    return held
