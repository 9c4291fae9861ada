"""Read and write the keys of a Zarr store as bytes, and flush them to the disk."""

from __future__ import annotations

import os
from collections.abc import Coroutine, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from vkbloom._checks import import_extra

if TYPE_CHECKING:
    from zarr.abc.store import Store

_PURPOSE: Final = "Grids on disk"
# The end of the names of LocalStore's temporary files.
_PARTIAL: Final = ".partial"


def _run(coroutine: Coroutine[Any, Any, Any]) -> Any:
    """Run a store's coroutine on zarr's own event loop, to which remote stores are bound."""
    return import_extra("zarr.core.sync", "grid", _PURPOSE).sync(coroutine)


def _buffers() -> Any:
    return import_extra("zarr.buffer", "grid", _PURPOSE).default_buffer_prototype()


class Keys:
    """A Zarr store by its keys."""

    def __init__(self, store: Store) -> None:
        self.store = store

    @property
    def _root(self) -> Path | None:
        """The folder of a local store; None for other stores."""
        root = getattr(self.store, "root", None)
        return root if isinstance(root, Path) else None

    @property
    def name(self) -> str:
        """The store's name in messages."""
        return str(self._root or self.store)

    @property
    def is_shared(self) -> bool:
        """Whether other processes can open it."""
        zarr = import_extra("zarr", "grid", _PURPOSE)
        return not isinstance(self.store, zarr.storage.MemoryStore)

    def read(self, key: str) -> bytes | None:
        """Return the bytes of a key; None if the key does not exist."""
        found = _run(self.store.get(key, _buffers()))
        return None if found is None else bytes(found.to_bytes())

    def write(self, key: str, content: bytes) -> None:
        """Write a key. On disk, a reader sees either the old content or the complete new one."""
        with self.named(key):
            _run(self.store.set(key, _buffers().buffer.from_bytes(content)))

    def create(self, key: str, content: bytes) -> None:
        """Write a key unless it exists. On disk, of several processes one does."""
        with self.named(key):
            _run(self.store.set_if_not_exists(key, _buffers().buffer.from_bytes(content)))

    def remove(self, key: str) -> None:
        """Remove a key, which may be missing."""
        _run(self.store.delete(key))

    @contextmanager
    def named(self, key: str) -> Iterator[None]:
        """Add the key to an OSError that names no file, as when the disk is full."""
        try:
            yield
        except OSError as error:
            if error.errno is None or error.filename is not None:
                raise
            raise OSError(error.errno, error.strerror, f"{self.name}/{key}") from error

    def all(self) -> set[str]:
        """Return all keys, without the temporary files of other processes."""

        async def listed() -> set[str]:
            return {key async for key in self.store.list() if not key.endswith(_PARTIAL)}

        found: set[str] = _run(listed())
        return found

    def flush(self, keys: Iterable[str]) -> None:
        """Flush written keys to the disk. Stores that are not local are durable already."""
        root = self._root
        if root is None:
            return
        paths = [root / key for key in keys]
        folders = {root, *(path.parent for path in paths)}
        for path in [*paths, *(folders if os.name == "posix" else ())]:
            _flush(path)

    def remove_leftovers(self) -> None:
        """Remove the temporary files of a process that was killed while writing."""
        root = self._root
        for path in root.glob(f"**/*{_PARTIAL}") if root else ():
            path.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def open_keys(store: Any) -> Keys:
    """Open a folder, which need not exist, a URL that fsspec supports, or a Zarr store."""
    zarr = import_extra("zarr", "grid", _PURPOSE)
    if isinstance(store, zarr.abc.store.Store):
        return Keys(store)
    if isinstance(store, str):
        # A local folder: use LocalStore, which writes each key atomically.
        store = store.removeprefix("file://")
        if "://" in store:
            return Keys(zarr.storage.FsspecStore.from_url(store))
    if isinstance(store, str | os.PathLike):
        return Keys(zarr.storage.LocalStore(Path(store).absolute()))
    raise TypeError(f"store: {store!r} is not a folder, a URL or a Zarr store")
