"""The chunks of a stored grid: each variable has one chunk per block of points.

Zarr reads and writes them. Each ends with a checksum, so that reading finds damage.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._checks import import_extra
from vkbloom._grid.keys import Keys
from vkbloom._grid.order import Block, Index

DONE: Final = "done"


@dataclass
class Chunks:
    """Reads and writes blocks; it can be sent to the process that renders them.

    `trailing` has the number of dimensions that are not axes, by variable; `chunk` has the number
    of values per block, by axis.
    """

    keys: Keys
    trailing: Mapping[str, int]
    chunk: Index

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the opened arrays."""
        return {"keys": self.keys, "trailing": self.trailing, "chunk": self.chunk}

    @functools.cached_property
    def _opened(self) -> dict[tuple[str, str], Any]:
        return {}

    def _array(self, name: str, mode: str) -> Any:
        if (name, mode) not in self._opened:
            zarr = import_extra("zarr", "grid", "Grids on disk")
            array = zarr.open_array(self.keys.store, path=name, mode=mode)
            # Also write chunks of zeros: a missing key would look like a missing point.
            self._opened[name, mode] = array.with_config({"write_empty_chunks": True})
        return self._opened[name, mode]

    def key(self, name: str, block: Block) -> str:
        """Return the key of a block's chunk of a variable."""
        numbers = (start // size for start, size in zip(block.start, self.chunk, strict=True))
        # An array without dimensions has the key "c".
        trailing = "0" * self.trailing.get(name, 0)
        return f"{name}/" + ".".join(["c", *map(str, numbers), *trailing])

    def write(self, block: Block, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a block's variables."""
        for name, values in arrays.items():
            with self.keys.named(name):
                self._array(name, "r+")[block.slices] = values

    def flush(self, written: Iterable[Block]) -> None:
        """Flush blocks to the disk."""
        self.keys.flush([self.key(name, block) for block in written for name in self.trailing])

    def mark(self, written: Iterable[Block]) -> None:
        """Mark blocks as done; their data must be on the disk."""
        blocks = list(written)
        for block in blocks:
            self.write(block, {DONE: np.ones(block.shape, np.bool_)})
        self.keys.flush([self.key(DONE, block) for block in blocks])

    def marked(self, block: Block, held: set[str]) -> bool | str:
        """Return whether a block is marked as done, or how its mark is damaged."""
        if self.key(DONE, block) not in held:
            return False
        try:
            return bool(self._read(DONE, block.slices).all())
        except ValueError as error:
            return f"damaged ({error})"

    def problem(self, name: str, block: Block, held: set[str]) -> str | None:
        """Return what is wrong with a block's chunk of a variable: it is missing or damaged."""
        if self.key(name, block) not in held:
            return "missing"
        try:
            self._read(name, block.slices)
        except ValueError as error:
            return f"damaged ({error})"
        return None

    def array_problem(self, name: str, held: set[str]) -> str | None:
        """Return what is wrong with an array's metadata, or with the values of a coordinate."""
        is_coordinate = name != DONE and name not in self.trailing
        keys = [f"{name}/zarr.json", *[f"{name}/c.0"] * is_coordinate]
        missing = [key for key in keys if key not in held]
        if missing:
            return f"{missing[0]} is missing"
        try:
            if is_coordinate:
                self._read(name, (...,))
            else:
                self._array(name, "r")
        except MemoryError:
            raise
        except Exception as error:  # Zarr does not document what damaged metadata raise
            return f"{keys[-1]} is damaged ({error})"
        return None

    def _read(self, name: str, slices: tuple[Any, ...]) -> NDArray[Any]:
        """Read a part of a variable, or raise ValueError if it is damaged."""
        try:
            found: NDArray[Any] = self._array(name, "r")[slices]
        except MemoryError:
            raise
        except Exception as error:
            # Zarr does not document the exceptions that damaged chunks and metadata raise.
            text = str(error).partition(". ")[0].removesuffix(".") or type(error).__name__
            raise ValueError(text) from error
        return np.asarray(found)
