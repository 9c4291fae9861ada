"""Read and write the keys of a Zarr store as bytes, and flush them to the disk."""

from __future__ import annotations

import asyncio
import functools
import os
import threading
from collections.abc import Coroutine, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from vkbloom.checks import import_extra

if TYPE_CHECKING:
    from zarr.abc.store import Store

__all__ = ["Keys", "open_keys"]

_PURPOSE: Final = "Grids on disk"
_T = TypeVar("_T")


def _buffers() -> Any:
    return import_extra("zarr.buffer", "grid", _PURPOSE).default_buffer_prototype()


@functools.cache
def _event_loop(process: int) -> asyncio.AbstractEventLoop:
    """Return a loop that runs in a thread: in a notebook the caller's loop is already running."""
    del process
    loop = asyncio.new_event_loop()
    threading.Thread(target=loop.run_forever, name="vkbloom-grid", daemon=True).start()
    return loop


def _run(coroutine: Coroutine[Any, Any, _T]) -> _T:
    # One loop per process, because a forked child does not have its parent's threads.
    return asyncio.run_coroutine_threadsafe(coroutine, _event_loop(os.getpid())).result()


def _for_own_loop(store: Store) -> Store:
    """Return a store whose connections may be used on this module's event loop."""
    zarr = import_extra("zarr", "grid", _PURPOSE)
    if not isinstance(store, zarr.storage.FsspecStore) or hasattr(store.fs, "sync_fs"):
        return store
    system = type(store.fs)(
        *store.fs.storage_args, **store.fs.storage_options, skip_instance_cache=True
    )
    return cast("Store", zarr.storage.FsspecStore(fs=system, path=store.path))


class Keys:
    """A Zarr store by its keys.

    Parameters
    ----------
    store : zarr.abc.store.Store
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        # Zarr runs a store's coroutines on an event loop of its own, which is not public.
        self._coroutines = _for_own_loop(store)

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
        found = _run(self._coroutines.get(key, _buffers()))
        return None if found is None else bytes(found.to_bytes())

    def write(self, key: str, content: bytes) -> None:
        """Write a key. On disk, a reader sees either the old content or the complete new one."""
        with self.named(key):
            _run(self._coroutines.set(key, _buffers().buffer.from_bytes(content)))

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
        """Return all keys."""

        async def listed() -> set[str]:
            return {key async for key in self._coroutines.list()}

        return _run(listed())

    def flush(self, keys: Iterable[str]) -> None:
        """Flush keys that were written to the disk.

        Does nothing for stores that are not local: they are durable when the write returns.
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
        """Remove the temporary files of a process that was killed while writing."""
        root = self._root
        for path in root.glob("**/*.partial") if root else ():
            path.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def open_keys(store: Any) -> Keys:
    """Open the keys of a store.

    Parameters
    ----------
    store : str, path-like or zarr.abc.store.Store
        A folder, which need not exist, a URL that fsspec supports, or a store.

    Returns
    -------
    Keys

    Raises
    ------
    TypeError
        The store is something else.
    """
    zarr = import_extra("zarr", "grid", _PURPOSE)
    if isinstance(store, zarr.abc.store.Store):
        return Keys(store)
    if isinstance(store, str) and "://" in store:
        system, path = import_extra("fsspec.core", "grid", _PURPOSE).url_to_fs(store)
        local = import_extra("fsspec.implementations.local", "grid", _PURPOSE)
        if not isinstance(system, local.LocalFileSystem):
            return Keys(zarr.storage.FsspecStore.from_url(store))
        # A local folder: use LocalStore, which writes each key atomically.
        store = path
    if isinstance(store, str | os.PathLike):
        return Keys(zarr.storage.LocalStore(Path(store).absolute()))
    raise TypeError(f"store: {store!r} is not a folder, a URL or a Zarr store")
