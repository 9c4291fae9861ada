"""The keys of a Zarr store as bytes: read, written, and brought safely to the disk."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vkbloom.checks import import_extra

if TYPE_CHECKING:
    from zarr.abc.store import Store

__all__ = ["Keys", "open_keys"]


class Keys:
    """A Zarr store by its keys.

    Parameters
    ----------
    store : zarr.abc.store.Store
    """

    def __init__(self, store: Store) -> None:
        self.store = store

    @property
    def _root(self) -> Path | None:
        """The folder of a store on this machine."""
        root = getattr(self.store, "root", None)
        return root if isinstance(root, Path) else None

    @property
    def name(self) -> str:
        """What the store is called in messages."""
        return str(self._root or self.store)

    @property
    def is_shared(self) -> bool:
        """Whether other processes can open it."""
        zarr = import_extra("zarr", "grid", "Grids on disk")
        return not isinstance(self.store, zarr.storage.MemoryStore)

    def read(self, key: str) -> bytes | None:
        """Return the bytes of a key, None where there is none."""
        prototype = import_extra("zarr.core.buffer", "grid", "Grids on disk")
        found = _sync(self.store.get(key, prototype.default_buffer_prototype()))
        return None if found is None else bytes(found.to_bytes())

    def write(self, key: str, content: bytes) -> None:
        """Write a key; on disk another reader sees all of it or what was there before."""
        prototype = import_extra("zarr.core.buffer", "grid", "Grids on disk")
        buffer = prototype.default_buffer_prototype().buffer.from_bytes(content)
        with self.named(key):
            _sync(self.store.set(key, buffer))

    @contextmanager
    def named(self, key: str) -> Iterator[None]:
        """Name what was written in an OSError that does not, as of a full disk."""
        try:
            yield
        except OSError as error:
            if error.errno is None or error.filename is not None:
                raise
            raise OSError(error.errno, error.strerror, f"{self.name}/{key}") from error

    def all(self) -> set[str]:
        """Return all keys."""

        async def listed() -> set[str]:
            return {key async for key in self.store.list()}

        found: set[str] = _sync(listed())
        return found

    def flush(self, keys: Iterable[str]) -> None:
        """Wait until keys that were written are on the disk.

        Stores elsewhere answer for that themselves.
        """
        root = self._root
        if root is None:
            return
        folders = {root}
        for key in keys:
            path = root / key
            _flush(path)
            folders.add(path.parent)
        if os.name == "posix":
            for folder in folders:
                _flush(folder)

    def remove_leftovers(self) -> None:
        """Remove the temporary files of a process that was killed while it wrote."""
        root = self._root
        for path in root.glob("**/*.partial") if root else ():
            path.unlink(missing_ok=True)


def _sync(coroutine: Any) -> Any:
    return import_extra("zarr.core.sync", "grid", "Grids on disk").sync(coroutine)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def open_keys(store: Any) -> Keys:
    """Open a store for its keys.

    Parameters
    ----------
    store : str, path-like or zarr.abc.store.Store
        A folder, which need not be there, a URL that fsspec knows, or a store.

    Returns
    -------
    Keys

    Raises
    ------
    TypeError
        It is something else.
    """
    zarr = import_extra("zarr", "grid", "Grids on disk")
    if isinstance(store, zarr.abc.store.Store):
        return Keys(store)
    if isinstance(store, str) and "://" in store:
        system, path = import_extra("fsspec.core", "grid", "Grids on disk").url_to_fs(store)
        local = import_extra("fsspec.implementations.local", "grid", "Grids on disk")
        if not isinstance(system, local.LocalFileSystem):
            return Keys(zarr.storage.FsspecStore.from_url(store))
        # A folder of this machine: what is promised of those holds for it, too.
        store = path
    if isinstance(store, str | os.PathLike):
        return Keys(zarr.storage.LocalStore(Path(store).absolute()))
    raise TypeError(f"store: a folder, a URL or a Zarr store is needed, not {store!r}")
