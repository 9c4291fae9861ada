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
processes with different parts need no lock: they write the same metadata. ``done/parts.N`` tells
that the grid is rendered in N parts, and the order of the axes in which they are divided; when all
parts are done, it is removed.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from vkbloom._checks import import_extra
from vkbloom._grid.chunks import DONE, Chunks
from vkbloom._grid.identity import FORMAT, differences, fingerprint, identity, short
from vkbloom._grid.keys import Keys
from vkbloom._grid.layout import Grid, Layout, Variable, attributes_of
from vkbloom._grid.order import Block, Index, blocks
from vkbloom._grid.parts import WHOLE, Part

METADATA: Final = "zarr.json"
IDENTITY: Final = "vkbloom_grid"
# In the folder of an array, where readers of Zarr expect chunks and list no members.
PARTS: Final = f"{DONE}/parts."

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
    facts = {"description": "Whether the point is done", "grid": fingerprint(own)}
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
        return self._blocks(self.part)

    def _blocks(self, part: Part) -> Iterable[Block]:
        return blocks(self.grid.shape, self.chunk, self.layout.ranking, part)

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
        found = list(written)
        self._chunks.mark(found)
        for block in found:
            self.done[block.slices] = True

    def finish(self) -> None:
        """Remove what only an incomplete store needs, if no other part is missing."""
        held = self.keys.all()
        if all(self._chunks.key(DONE, block) in held for block in self._blocks(WHOLE)):
            self.keys.remove_leftovers()
            for key in held:
                if key.startswith(PARTS):
                    self.keys.remove(key)

    def prepare(self, *, resume: bool, verify: bool) -> None:
        """Create the store, or examine an existing one and replace damaged metadata.

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
        self._check_identity(expected)
        if self.part == WHOLE:
            self.keys.remove_leftovers()
        for key, content in expected.items():
            stored = self.keys.read(key) if held or key == METADATA else None
            if normal(key, stored) != normal(key, content):
                self.keys.write(key, content)
        self.keys.flush(expected)
        if self.part != WHOLE:
            order = json.dumps(self.layout.ranking).encode()
            self.keys.write(f"{PARTS}{self.part[1]}", order)
        if held:
            self._find_done(held, verify=verify)

    def _check_identity(self, expected: Mapping[str, bytes]) -> None:
        """Raise ValueError unless the store contains this grid."""
        root = read_json(self.keys.read(METADATA))
        if root is not None:
            asked = identity(self.grid, self.layout, self.chunk)
            found = differences(checked_identity(root, self.keys.name), asked)
            if found:
                raise ValueError(f"{self.keys.name}: contains another grid; {'; '.join(found)}")
        # ``done`` names its grid too. A process that was killed early may not have written it.
        mark = mark_of(read_json(self.keys.read(f"{DONE}/{METADATA}")))
        own = mark_of(read_json(expected[f"{DONE}/{METADATA}"]))
        if mark != own and (root is None or mark is not None):
            what = "contains another grid" if mark else "its content is not a grid of vkbloom"
            raise ValueError(f"{self.keys.name}: {what}, and its {METADATA} is missing or damaged")

    def _find_done(self, held: set[str], *, verify: bool) -> None:
        """Find the completed points, and remove the marks of damaged ones."""
        unmarked = []
        for block in self.blocks():
            marked = self._chunks.marked(block, held)
            if not (marked or verify):
                continue
            problems = (
                self._chunks.problem(name, block, held, read=verify)
                for name in self.layout.variables
            )
            is_complete = not any(problems)
            self.done[block.slices] = is_complete
            if is_complete and marked is not True:
                # A complete block without a mark was written just before the process ended.
                unmarked.append(block)
            elif marked and not is_complete:
                self.keys.remove(self._chunks.key(DONE, block))
        self._chunks.mark(unmarked)


def read_json(content: bytes | None) -> dict[str, Any] | None:
    """Parse the JSON object of a key; None if it is missing or damaged."""
    try:
        found = None if content is None else json.loads(content)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def normal(key: str, content: bytes | None) -> bytes | str | None:
    """Return a key's content, metadata without white space and order of names, to compare it.

    Metadata are compared as text, because in Python 3.0 == 3 and True == 1.
    """
    if not key.endswith(METADATA):
        return content
    found = read_json(content)
    try:
        return None if found is None else json.dumps(found, sort_keys=True)
    except RecursionError:
        return None


def stored_identity(root: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the grid's identity from the group's metadata; None if there is none."""
    stored = _attributes(root).get(IDENTITY)
    found = read_json(stored.encode()) if isinstance(stored, str) else None
    return found if isinstance(found, dict) else None


def checked_identity(root: Mapping[str, Any], store: str) -> dict[str, Any]:
    """Return the grid's identity, or raise ValueError if there is none of this version."""
    found = stored_identity(root)
    if found is None:
        raise ValueError(f"{store}: its content is not a grid of vkbloom")
    version = found.get("format")
    if version != FORMAT:
        raise ValueError(f"{store}: its format version {short(version)} is not {FORMAT}")
    return found


def mark_of(metadata: Mapping[str, Any] | None) -> str | None:
    """Return the fingerprint of the grid in the metadata of ``done``; None if there is none."""
    found = _attributes(metadata or {}).get("grid")
    return found if isinstance(found, str) else None


def _attributes(metadata: Mapping[str, Any]) -> Mapping[str, Any]:
    found = metadata.get("attributes")
    return found if isinstance(found, dict) else {}
