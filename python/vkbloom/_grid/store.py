"""A grid in a Zarr store, which xarray can open at any time.

The process may be killed at any time, because it writes in this order:

1. The group's metadata, with the identity of the grid and a copy of the arrays' metadata. They
   are created only where there are none: of processes with different grids, one writes, and the
   others are refused.
2. The arrays' metadata, and the coordinates.
3. Blocks of points: a complete chunk of each variable, with a checksum, then the chunk of
   ``done``.

``done`` has the same chunks as the variables. So a process writes only keys of its own blocks, and
processes with different parts need no lock: they write the same metadata.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Container, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._grid.keys import PURPOSE, Keys
from vkbloom._grid.layout import Grid, Layout, Variable, make_dataset
from vkbloom._grid.order import WHOLE, GridBlock, Index, Part, blocks
from vkbloom._settings.records import plain_value

#: Version of the store's layout. A store with another version cannot be read.
FORMAT: Final = 3

_MAX_CHARACTERS: Final = 60  # characters of a value in a message
DONE: Final = "done"
METADATA: Final = "zarr.json"
MISSING: Final = "missing"
IDENTITY: Final = "vkbloom_grid"
# Level 1 is fast; on noisy pictures higher levels compress little better.
_ZSTD_LEVEL: Final = 1
# The separator "." puts all chunks of an array in one folder; "/" would nest a folder per axis.
_KEYS: Final = {"name": "default", "separator": "."}
# Blocks that are read at a time: an object store answers each request after a while.
_READERS: Final = 16


def identity(grid: Grid, layout: Layout, chunk: Index) -> dict[str, Any]:
    """Return everything that determines the contents of a grid's arrays, as JSON values."""
    facts = {
        "format": FORMAT,
        **layout.origin,
        "source": grid.source.description,
        "settings": grid.remaining_settings,
        **({"stages": stages} if (stages := grid.remaining_stages) else {}),
        "axes": {axis.name: [plain_value(value) for value in axis.values] for axis in grid.axes},
        "order of axes": [axis.name for axis in grid.axes],
        "variables": {
            name: {"shape": variable.shape, "dtype": variable.dtype.name}
            for name, variable in layout.variables.items()
        },
        "reduce": {name: _name_of(reduction) for name, reduction in grid.reduce.items()},
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


def _name_of(reduction: Any) -> str:
    kind = reduction if hasattr(reduction, "__qualname__") else type(reduction)
    return f"{kind.__module__}.{kind.__qualname__}"


def differences(stored: Any, asked: Any, name: str = "") -> Iterator[str]:
    """Yield the differences between the grid in a store and the requested one."""
    if isinstance(stored, Mapping) and isinstance(asked, Mapping):
        for key in dict.fromkeys((*stored, *asked)):
            inner = f"{name}.{key}" if name else key
            if key not in stored:
                yield f"{inner}: not in the store, {short(asked[key])} requested"
            elif key not in asked:
                yield f"{inner}: {short(stored[key])} in the store, not requested"
            else:
                yield from differences(stored[key], asked[key], inner)
    elif stored != asked:
        yield f"{name}: {short(stored)} in the store, {short(asked)} requested"


def short(value: Any) -> str:
    """Return any JSON value as a short text for a message."""
    text = json.dumps(value)
    if len(text) <= _MAX_CHARACTERS:
        return text
    return f"{text[: _MAX_CHARACTERS - 20]} ... {text[-12:]}"


@dataclass
class Chunks:
    """Reads and writes blocks; it can be sent to the process that renders them.

    `trailing` has the number of dimensions that are not axes, by variable; `chunk` has the number
    of values per block, by axis.
    """

    keys: Keys
    trailing: Mapping[str, int]
    chunk: Index
    _opened: dict[str, Any] = field(default_factory=dict)

    def _array(self, name: str) -> Any:
        if name not in self._opened:
            zarr = import_extra("zarr", "grid", PURPOSE)
            store = self.keys.store
            mode = "r" if store.read_only else "r+"
            array = zarr.open_array(store, path=name, mode=mode, zarr_format=3)
            # Also write chunks of zeros: a missing key would look like a missing point.
            self._opened[name] = array.with_config({"write_empty_chunks": True})
        return self._opened[name]

    def key(self, name: str, block: GridBlock) -> str:
        """Return the key of a block's chunk of a variable."""
        numbers = (start // size for start, size in zip(block.start, self.chunk, strict=True))
        # An array without dimensions has the key "c".
        trailing = "0" * self.trailing.get(name, 0)
        return f"{name}/" + ".".join(["c", *map(str, numbers), *trailing])

    def write(self, block: GridBlock, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a block's variables, then mark it as done."""
        for name, values in {**arrays, DONE: np.True_}.items():
            with self.keys.name_errors(name):
                self._array(name)[block.slices] = values

    def problems(
        self, examined: Sequence[GridBlock], held: Container[str]
    ) -> Iterator[Mapping[str, str | None]]:
        """Yield what is wrong with each block's chunks by variable: missing, damaged or None.

        `held` has the keys of the store.
        """

        def examine(block: GridBlock) -> Mapping[str, str | None]:
            return {name: self._problem(name, block, held) for name in (DONE, *self.trailing)}

        with ThreadPoolExecutor(_READERS, "vkbloom-read") as pool:
            for first in range(0, len(examined), _READERS):
                yield from pool.map(examine, examined[first : first + _READERS])

    def _problem(self, name: str, block: GridBlock, held: Container[str]) -> str | None:
        key = self.key(name, block)
        return self._damage(name, key, block.slices) if key in held else MISSING

    def array_problem(self, name: str, held: Container[str]) -> str | None:
        """Return what is wrong with an array's metadata, or with the values of a coordinate."""
        is_coordinate = name not in (DONE, *self.trailing)
        keys = [f"{name}/{METADATA}", *[f"{name}/c.0"] * is_coordinate]
        for key in keys:
            if key not in held:
                return f"{key} is missing"
        damage = self._damage(name, keys[-1], (...,) if is_coordinate else None)
        return f"{keys[-1]} is {damage}" if damage else None

    def _damage(self, name: str, key: str, slices: tuple[Any, ...] | None) -> str | None:
        """Return how a part of a variable is damaged; None: only its metadata are read."""
        try:
            array = self._array(name)
            if slices is not None:
                array[slices]
        except MemoryError:
            raise
        except Exception as error:  # Zarr does not document what damaged metadata and chunks raise
            if self.keys.folder is None:
                # Raises if the store cannot be read, which is no damage.
                self.keys.read(key)
            text = str(error).partition(". ")[0].removesuffix(".") or type(error).__name__
            return f"damaged ({text})"
        return None


def expected_keys(grid: Grid, layout: Layout, chunk: Index) -> dict[str, bytes]:
    """Return the contents of a store before its first block, the group's metadata first."""
    zarr = import_extra("zarr", "grid", PURPOSE)
    codecs = import_extra("zarr.codecs", "grid", PURPOSE)
    dask = import_extra("dask.array", "grid", PURPOSE)
    facts = {"description": "Whether the point is done"}
    marked = {**layout.variables, DONE: Variable((), (), np.dtype(np.bool_), facts)}
    dataset = make_dataset(
        grid,
        replace(layout, variables=marked),
        {
            name: dask.zeros((*grid.shape, *variable.shape), dtype=variable.dtype, chunks=-1)
            for name, variable in marked.items()
        },
    )
    for name, coordinate in dataset.coords.items():
        if coordinate.dtype.kind == "U":
            # Of texts, Zarr's format 3 defines those of any length alone.
            dataset[name] = coordinate.astype(np.dtypes.StringDType())
    # (As text: netCDF stores no mappings.)
    dataset.attrs[IDENTITY] = json.dumps(identity(grid, layout, chunk))
    # The checksum is the last codec, so that it covers the compressed bytes.
    compressors = [codecs.ZstdCodec(level=_ZSTD_LEVEL), codecs.Crc32cCodec()]
    encoding: dict[Any, dict[str, Any]] = {
        # A fill value among the attributes would make readers mask and convert.
        name: {"compressors": compressors, "chunk_key_encoding": _KEYS, "_FillValue": None}
        for name in dataset.variables
    }
    for name, variable in marked.items():
        encoding[name]["chunks"] = (*chunk, *variable.shape)
    # Marks are too small for a compression, which zarr runs in a thread.
    encoding[DONE]["compressors"] = compressors[1:]
    held: dict[str, Any] = {}
    with warnings.catch_warnings():
        # Zarr warns because format 3 does not define consolidated metadata; xarray reads them.
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        dataset.to_zarr(
            zarr.storage.MemoryStore(held), zarr_format=3, compute=False, encoding=encoding
        )
    names = sorted(held, key=lambda key: (key != METADATA, key))
    return {key: bytes(held[key].to_bytes()) for key in names}


@dataclass(frozen=True)
class GridStore:
    """A prepared store.

    - `missing`: The blocks of the part that are not done, in the order in which they are rendered.
    - `total`: The number of points of the part.
    """

    chunks: Chunks
    layout: Layout
    missing: list[GridBlock]
    total: int

    @property
    def done(self) -> int:
        """The number of points that were done before."""
        return self.total - sum(block.count for block in self.missing)


def prepare(
    keys: Keys, grid: Grid, layout: Layout, chunk: Index, part: Part = WHOLE, *, resume: bool
) -> GridStore:
    """Create the store, or examine an existing one and replace damaged metadata of arrays.

    FileExistsError: the store exists and `resume` is False. ValueError: it contains other data or
    another grid; nothing is written.
    """
    expected = expected_keys(grid, layout, chunk)
    held = keys.list_keys()
    if held and not resume:
        raise FileExistsError(
            f"{keys.name}: the store already has a grid; resume it, or name another store"
        )
    if not held:
        # Of processes that start at once, one decides which grid this is.
        keys.create(METADATA, expected[METADATA])
    if changed := [*differences(check_identity(keys), identity(grid, layout, chunk))]:
        told = "; ".join(changed)
        raise ValueError(f"{keys.name}: contains another grid; {told}; delete it or name another")
    if part == WHOLE:
        keys.remove_partial(expected)
    for key, content in expected.items():
        is_there = key in held or key == METADATA
        if not is_there or keys.read(key) != content:
            keys.write(key, content)
    trailing = {name: len(variable.shape) for name, variable in layout.variables.items()}
    chunks = Chunks(keys, trailing, chunk)
    every = list(blocks(grid.shape, chunk, layout.ranking, part))
    missing = []
    for block, problems in zip(every, chunks.problems(every, held), strict=True):
        if any(problems.values()):
            if problems[DONE] != MISSING:
                keys.remove(chunks.key(DONE, block))
            missing.append(block)
    return GridStore(chunks, layout, missing, sum(block.count for block in every))


def stored_identity(keys: Keys) -> dict[str, Any] | None:
    """Return the grid's identity from the group's metadata; None if there is none."""
    content = keys.read(METADATA)
    try:
        held = json.loads(json.loads(content or b"")["attributes"][IDENTITY])
    except (KeyError, TypeError, ValueError, RecursionError):
        return None
    return held if isinstance(held, dict) else None


def check_identity(keys: Keys) -> dict[str, Any]:
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
