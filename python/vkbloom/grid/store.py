"""A grid in a Zarr store, which xarray can open at any time.

The process may be killed at any time, because it writes in this order:

1. The group's metadata, which contain the identity of the grid and a copy of all other metadata.
2. The metadata of the arrays, and the coordinates.
3. Blocks of points: a complete chunk of each variable, with a checksum. Zarr's LocalStore writes
   a key to a temporary file first and renames it.
4. The marks in ``done``, after the blocks have been flushed to the disk.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.grid.axes import Axis
from vkbloom.grid.chunks import check_summed
from vkbloom.grid.identity import FORMAT, differences, identity, short
from vkbloom.grid.keys import Keys
from vkbloom.grid.order import Block, Index, blocks, default_chunk
from vkbloom.grid.plan import Grid, Layout, Variable, attributes_of
from vkbloom.grid.running import Writer

__all__ = [
    "DIGESTS",
    "DONE",
    "IDENTITY",
    "ROOT",
    "GridStore",
    "GridWriter",
    "checked_identity",
    "chunk_key",
    "describe",
    "digest",
    "done_chunk",
    "read_json",
    "read_marks",
    "reason",
    "stored_identity",
]

ROOT: Final = "zarr.json"
IDENTITY: Final = "vkbloom_grid"
DIGESTS: Final = "vkbloom_digests"
DONE: Final = "done"

_PURPOSE: Final = "Grids on disk"
_DONE_POINTS: Final = 1 << 20
# Level 1 is fast; on noisy pictures higher levels compress little better.
_ZSTD_LEVEL: Final = 1
# The separator "." puts all chunks of an array in one folder; "/" would nest a folder per axis.
_KEYS: Final = {"name": "default", "separator": "."}


def chunk_key(name: str, block: Block, chunk: Index, trailing: int) -> str:
    """Return the key of the chunk that contains a block of a variable.

    Parameters
    ----------
    name : str
        Name of the variable.
    block : Block
    chunk : tuple of int
        Number of values per block by axis.
    trailing : int
        Number of the variable's dimensions that are not axes; chunks do not divide them.
    """
    places = (start // size for start, size in zip(block.start, chunk, strict=True))
    # An array without dimensions has the key "c".
    return f"{name}/" + ".".join(["c", *map(str, places), *("0" * trailing)])


def expected_keys(grid: Grid, layout: Layout, chunk: Index) -> dict[str, bytes]:
    """Return the contents of a store before its first block, the group's metadata first.

    Parameters
    ----------
    grid : Grid
    layout : Layout
    chunk : tuple of int

    Returns
    -------
    dict of str to bytes
    """
    zarr = import_extra("zarr", "grid", _PURPOSE)
    memory = zarr.storage.MemoryStore()
    own = identity(grid, layout, chunk)
    attributes = {**attributes_of(grid, layout), IDENTITY: own}
    group = zarr.open_group(memory, mode="w", zarr_format=3, attributes=attributes)
    dims = tuple(axis.name for axis in grid.axes)
    mark = {"grid": hashlib.sha256(json.dumps(own).encode()).hexdigest()}
    for axis in grid.axes:
        _add_coordinate(group, axis.name, axis.coordinate, axis.attributes)
    for name, (values, attrs) in layout.coordinates.items():
        _add_coordinate(group, name, values, attrs)
    _add_array(
        group,
        DONE,
        Variable((), (), np.dtype(np.bool_), {"description": "Whether the point is done", **mark}),
        (dims, grid.shape, done_chunk(grid.shape)),
    )
    for name, variable in layout.variables.items():
        marked = Variable(
            variable.dims, variable.shape, variable.dtype, {**variable.attributes, **mark}
        )
        _add_array(group, name, marked, (dims, grid.shape, chunk))
    keys = Keys(memory)
    group.attrs[DIGESTS] = {key: digest(key, keys.read(key)) for key in sorted(keys.all() - {ROOT})}
    with warnings.catch_warnings():
        # Zarr warns because format 3 does not define consolidated metadata; xarray reads them.
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(memory)
    names = sorted(keys.all(), key=lambda key: (key != ROOT, key))
    return {key: keys.read(key) or b"" for key in names}


def digest(key: str, content: bytes | None) -> str | None:
    """Return the SHA-256 of a key's content; None if it is missing or damaged.

    JSON is hashed in a normal form: white space and the order of names make no difference.
    """
    if content is None:
        return None
    if key.endswith(ROOT):
        found = read_json(content)
        try:
            # Compared as text, because in Python 3.0 == 3 and True == 1.
            content = None if found is None else json.dumps(found, sort_keys=True).encode()
        except RecursionError:
            content = None
    return None if content is None else hashlib.sha256(content).hexdigest()


def done_chunk(shape: Index) -> Index:
    """Return the grid points per chunk of ``done``, by axis."""
    return default_chunk(shape, range(len(shape)), _DONE_POINTS)


def _add_coordinate(
    group: Any, name: str, values: NDArray[Any], attributes: Mapping[str, str]
) -> None:
    """Add the coordinate of a dimension to a Zarr group, as an array with one chunk."""
    is_text = values.dtype.kind == "U"
    array = group.create_array(
        name,
        shape=values.shape,
        chunks=values.shape,
        dtype=str if is_text else values.dtype,
        dimension_names=[name],
        attributes=dict(attributes),
        chunk_key_encoding=_KEYS,
        config={"write_empty_chunks": True},
    )
    array[...] = values.astype(object) if is_text else values


def _add_array(
    group: Any, name: str, variable: Variable, lattice: tuple[tuple[str, ...], Index, Index]
) -> None:
    """Add a variable without its chunks to a Zarr group.

    `lattice` has the names of the axes, their lengths, and the lengths of a block.
    """
    codecs = import_extra("zarr.codecs", "grid", _PURPOSE)
    dims, shape, chunk = lattice
    group.create_array(
        name,
        shape=(*shape, *variable.shape),
        chunks=(*chunk, *variable.shape),
        dtype=variable.dtype,
        dimension_names=[*dims, *variable.dims],
        attributes=dict(variable.attributes),
        chunk_key_encoding=_KEYS,
        # The checksum is the last codec, so that it covers the compressed bytes.
        compressors=[codecs.ZstdCodec(level=_ZSTD_LEVEL), codecs.Crc32cCodec()],
        fill_value=math.nan if variable.dtype.kind == "f" else 0,
    )


@dataclass
class GridWriter:
    """Writes blocks to a store; it can be sent to the process that renders them.

    Parameters
    ----------
    keys : Keys
    trailing : mapping of str to int
        Number of dimensions that are not axes, by variable.
    chunk : tuple of int
    """

    keys: Keys
    trailing: Mapping[str, int]
    chunk: Index

    def _array(self, name: str) -> Any:
        zarr = import_extra("zarr", "grid", _PURPOSE)
        array = zarr.open_array(self.keys.store, path=name, mode="r+")
        # Also write chunks of zeros: a missing key would look like a missing point.
        return array.with_config({"write_empty_chunks": True})

    def write(self, block: Block, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a block's variables."""
        for name, values in arrays.items():
            with self.keys.named(name):
                self._array(name)[block.slices] = values

    def keys_of(self, block: Block) -> list[str]:
        """Return the keys of a block's chunks."""
        return [chunk_key(name, block, self.chunk, n) for name, n in self.trailing.items()]

    def flush(self, written: Iterable[Block]) -> None:
        """Flush blocks to the disk."""
        self.keys.flush(itertools.chain.from_iterable(map(self.keys_of, written)))


class GridStore:
    """The Zarr store of a grid, with its marks of completed points.

    Parameters
    ----------
    keys : Keys
    grid : Grid
    layout : Layout
    chunk : tuple of int
        Number of values per block by axis.

    Attributes
    ----------
    done : ndarray of bool, shape of the grid
        The points that are completely on the disk.
    writer : Writer
    """

    def __init__(self, keys: Keys, grid: Grid, layout: Layout, chunk: Index) -> None:
        self.keys = keys
        self.grid = grid
        self.layout = layout
        self.chunk = chunk
        self.done = np.zeros(grid.shape, np.bool_)
        self._chunks = GridWriter(
            keys, {name: len(v.shape) for name, v in layout.variables.items()}, chunk
        )

    @property
    def writer(self) -> Writer:
        """The writer of blocks, which can be sent to other processes."""
        return self._chunks

    def blocks(self) -> Iterable[Block]:
        """Return all blocks in the order in which they are rendered."""
        return blocks(self.grid.shape, self.chunk, self.layout.ranking)

    def missing(self) -> Iterable[Block]:
        """Return the blocks that are not done, in the order in which they are rendered."""
        return (block for block in self.blocks() if not self.done[block.slices].all())

    def prepare(self, *, resume: bool, verify: bool) -> list[str]:
        """Create the store, or examine an existing one and replace damaged metadata.

        Parameters
        ----------
        resume : bool
            Whether to continue an existing store.
        verify : bool
            Whether to read all existing chunks.

        Returns
        -------
        list of str
            A phrase for each damaged or missing key.

        Raises
        ------
        FileExistsError
            The store exists and `resume` is False.
        ValueError
            The store contains other data or another grid; the message lists the differences.
            Nothing is written.
        """
        expected = expected_keys(self.grid, self.layout, self.chunk)
        held = self.keys.all()
        if not held:
            for key, content in expected.items():
                self.keys.write(key, content)
            self.keys.flush(expected)
            return []
        if not resume:
            raise FileExistsError(
                f"{self.keys.name}: the store already has a grid; resume it, or name another store"
            )
        self._check_identity(held, expected)
        self.keys.remove_leftovers()
        mended = self._mend_metadata(expected)
        return mended + self._find_done(held, verify=verify)

    def _check_identity(self, held: set[str], expected: Mapping[str, bytes]) -> None:
        """Raise ValueError unless the store contains this grid."""
        asked = identity(self.grid, self.layout, self.chunk)
        root = read_json(self.keys.read(ROOT))
        if root is not None:
            found = differences(checked_identity(root, self.keys.name), asked)
            if found:
                raise ValueError(f"{self.keys.name}: contains another grid; {'; '.join(found)}")
        # The arrays name their grid too. A process that was killed early may have written none.
        marks = {_mark(self.keys.read(key)) for key in held if key.endswith(f"/{ROOT}")} - {None}
        own = _mark(expected[f"{DONE}/{ROOT}"])
        is_other = marks != {own} if root is None else bool(marks) and own not in marks
        if is_other:
            what = "contains another grid" if marks else "its content is not a grid of vkbloom"
            raise ValueError(f"{self.keys.name}: {what}, and its {ROOT} is missing or damaged")

    def _mend_metadata(self, expected: Mapping[str, bytes]) -> list[str]:
        mended = []
        for key, content in expected.items():
            found = self.keys.read(key)
            if digest(key, found) != digest(key, content):
                self.keys.write(key, content)
                mended.append(f"{key} was {'missing' if found is None else 'damaged'}")
        self.keys.flush(expected)
        return mended

    def _find_done(self, held: set[str], *, verify: bool) -> list[str]:
        """Find the completed points, and clear the marks of damaged ones."""
        mended: list[str] = []
        try:
            marked = read_marks(self.keys, self.grid.shape)
        except (ValueError, OSError) as error:
            mended.append(f"the marks in {DONE} were damaged ({reason(error)})")
            marked = np.zeros(self.grid.shape, np.bool_)
        for block in self.blocks():
            is_marked = bool(marked[block.slices].all())
            if not is_marked and not verify:
                continue
            problem = self._problem(block, held, verify=verify)
            # A complete block without a mark was written just before the process ended.
            self.done[block.slices] = problem is None
            if is_marked and problem is not None:
                mended.append(f"{problem}, of {describe(self.grid.axes, block)}")
        if not np.array_equal(self.done, marked) or mended:
            self._write_marks(np.ones(self.grid.shape, np.bool_))
        return mended

    def _problem(self, block: Block, held: set[str], *, verify: bool) -> str | None:
        for name, key in zip(self._chunks.trailing, self._chunks.keys_of(block), strict=True):
            if key not in held:
                return f"{key} was missing"
            if verify:
                size = math.prod(self.chunk) * self.layout.variables[name].size
                try:
                    check_summed(self.keys.read(key) or b"", size)
                except (ValueError, OSError) as error:
                    return f"{key} was damaged ({reason(error)})"
        return None

    def mark(self, written: Iterable[Block]) -> None:
        """Mark points as done; their data must be on the disk."""
        touched = np.zeros(self.grid.shape, np.bool_)
        for block in written:
            self.done[block.slices] = True
            touched[block.slices] = True
        self._write_marks(touched)

    def _write_marks(self, touched: NDArray[np.bool_]) -> None:
        """Write each chunk of ``done`` that contains a touched point, in one write."""
        zarr = import_extra("zarr", "grid", _PURPOSE)
        array = zarr.open_array(self.keys.store, path=DONE, mode="r+")
        array = array.with_config({"write_empty_chunks": True})
        written = []
        for part in blocks(self.grid.shape, array.chunks, range(touched.ndim)):
            if touched[part.slices].any():
                with self.keys.named(DONE):
                    array[part.slices] = self.done[part.slices]
                written.append(chunk_key(DONE, part, array.chunks, 0))
        self.keys.flush(written)


def read_marks(keys: Keys, shape: Index) -> NDArray[np.bool_]:
    """Read which points of a grid are marked as done.

    Raises
    ------
    ValueError, OSError
        The marks are damaged.
    """
    chunk = done_chunk(shape)
    for part in blocks(shape, chunk, range(len(shape))):
        content = keys.read(chunk_key(DONE, part, chunk, 0))
        if content is not None:
            check_summed(content, math.prod(chunk))
    zarr = import_extra("zarr", "grid", _PURPOSE)
    try:
        array = zarr.open_array(keys.store, path=DONE, mode="r")
        if (array.shape, array.chunks, array.dtype) != (shape, chunk, np.bool_):
            raise ValueError("the array has another shape, chunk or dtype")
        marks: NDArray[np.bool_] = array[...]
    except (MemoryError, OSError):
        raise
    except Exception as error:
        # Zarr does not document the exceptions that damaged metadata raise.
        raise ValueError(reason(error)) from error
    return marks


def describe(axes: Iterable[Axis], block: Block) -> str:
    """Return the points of a block as text: the value, or first and last value, of each axis."""
    parts = []
    for axis, start, stop in zip(axes, block.start, block.stop, strict=True):
        labels = [axis.label(start)] + [axis.label(stop - 1)] * (stop - start > 1)
        parts.append(f"{axis.name}={'..'.join(labels)}")
    return ", ".join(parts) or "the only point"


def reason(error: Exception) -> str:
    """Return the first sentence of an error's message."""
    return str(error).partition(". ")[0].removesuffix(".") or type(error).__name__


def read_json(content: bytes | None) -> dict[str, Any] | None:
    """Parse the JSON object of a key; None if it is missing or damaged."""
    try:
        found = None if content is None else json.loads(content)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def stored_identity(root: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the grid's identity from the group's metadata; None if there is none."""
    found = _attributes(root).get(IDENTITY)
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


def _attributes(metadata: Mapping[str, Any]) -> Mapping[str, Any]:
    found = metadata.get("attributes")
    return found if isinstance(found, dict) else {}


def _mark(content: bytes | None) -> str | None:
    """Return the hash of the grid that an array's metadata name; None if there is none."""
    found = _attributes(read_json(content) or {}).get("grid")
    return found if isinstance(found, str) else None
