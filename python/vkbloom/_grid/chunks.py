"""The chunks of a stored grid: each variable has one chunk per block of points.

Zarr reads and writes them. Each ends with a checksum, so that reading finds damage.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._checks import import_extra
from vkbloom._grid.order import Block, Index

DONE: Final = "done"
METADATA: Final = "zarr.json"
MISSING: Final = "missing"


@dataclass
class Chunks:
    """Reads and writes blocks; it can be sent to the process that renders them.

    `trailing` has the number of dimensions that are not axes, by variable; `chunk` has the number
    of values per block, by axis.
    """

    folder: Path
    trailing: Mapping[str, int]
    chunk: Index
    _opened: dict[str, Any] = field(default_factory=dict)

    def _array(self, name: str) -> Any:
        if name not in self._opened:
            zarr = import_extra("zarr", "grid", "Grids on disk")
            array = zarr.open_array(self.folder / name, mode="r+")
            # Also write chunks of zeros: a missing key would look like a missing point.
            self._opened[name] = array.with_config({"write_empty_chunks": True})
        return self._opened[name]

    def key(self, name: str, block: Block) -> str:
        """Return the key of a block's chunk of a variable."""
        numbers = (start // size for start, size in zip(block.start, self.chunk, strict=True))
        # An array without dimensions has the key "c".
        trailing = "0" * self.trailing.get(name, 0)
        return f"{name}/" + ".".join(["c", *map(str, numbers), *trailing])

    def write(self, block: Block, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a block's variables, then mark it as done."""
        for name, values in {**arrays, DONE: np.True_}.items():
            try:
                self._array(name)[block.slices] = values
            except OSError as error:
                # A full disk names no file.
                error.filename = error.filename or str(self.folder / name)
                raise

    def problem(self, name: str, block: Block) -> str | None:
        """Return what is wrong with a block's chunk of a variable: it is missing or damaged."""
        if not (self.folder / self.key(name, block)).exists():
            return MISSING
        return self._damage(name, block.slices)

    def array_problem(self, name: str) -> str | None:
        """Return what is wrong with an array's metadata, or with the values of a coordinate."""
        is_coordinate = name not in (DONE, *self.trailing)
        keys = [f"{name}/{METADATA}", *[f"{name}/c.0"] * is_coordinate]
        for key in keys:
            if not (self.folder / key).exists():
                return f"{key} is missing"
        damage = self._damage(name, (...,) if is_coordinate else None)
        return f"{keys[-1]} is {damage}" if damage else None

    def _damage(self, name: str, slices: tuple[Any, ...] | None) -> str | None:
        """Return how a part of a variable is damaged; None: only its metadata are read."""
        try:
            array = self._array(name)
            if slices is not None:
                array[slices]
        except MemoryError:
            raise
        except Exception as error:  # Zarr does not document what damaged metadata and chunks raise
            text = str(error).partition(". ")[0].removesuffix(".") or type(error).__name__
            return f"damaged ({text})"
        return None
