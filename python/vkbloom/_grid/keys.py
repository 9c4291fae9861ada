"""The keys of a Zarr store: files of a folder, or objects in a cloud or in memory.

A reader sees a key as it was or as it is written, never a part of it: Zarr's LocalStore renames a
temporary file, and object stores promise the same of each object.
"""

from __future__ import annotations

import os
import pickle
import re
from collections.abc import Coroutine, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from vkbloom._extras import import_extra

if TYPE_CHECKING:
    from zarr.abc.store import Store

PURPOSE: Final = "A grid in a store"
# Names of LocalStore's temporary files: of a key without its last suffix, a number, ".partial".
_PARTIAL: Final = re.compile(r"(?:zarr|c(?:\.[0-9]+)*)\.[0-9a-f]+\.partial")


def _zarr() -> Any:
    return import_extra("zarr", "grid", PURPOSE)


def _run(coroutine: Coroutine[Any, Any, Any]) -> Any:
    """Run a store's coroutine on Zarr's event loop, to which connections are bound."""
    return import_extra("zarr.core.sync", "grid", PURPOSE).sync(coroutine)


def _buffers() -> Any:
    return import_extra("zarr.core.buffer", "grid", PURPOSE).default_buffer_prototype()


@dataclass(frozen=True)
class Keys:
    """A Zarr store by its keys.

    `name` names the store in messages.
    """

    store: Store
    name: str

    @property
    def folder(self) -> Path | None:
        """The folder of a local store; None for other stores."""
        if not isinstance(self.store, _zarr().storage.LocalStore):
            return None
        folder: Path = self.store.root
        return folder

    def read(self, key: str) -> bytes | None:
        """Return the bytes of a key; None if the key does not exist."""
        if self.folder is not None and not self.folder.is_dir():
            # LocalStore would make the folder.
            return None
        with self.name_errors(key):
            content = _run(self.store.get(key, _buffers()))
        return None if content is None else bytes(content.to_bytes())

    def write(self, key: str, content: bytes) -> None:
        """Write a key."""
        with self.name_errors(key):
            _run(self.store.set(key, _buffers().buffer.from_bytes(content)))

    def create(self, key: str, content: bytes) -> None:
        """Write a key unless it exists: of several processes one does, where the store can."""
        try:
            _run(self._create(key, content))
        except FileExistsError:
            pass
        except Exception:
            # A server may lack conditional writes. What else failed fails again.
            if self.read(key) is None:
                self.write(key, content)

    def _create(self, key: str, content: bytes) -> Coroutine[Any, Any, Any]:
        if isinstance(self.store, _zarr().storage.FsspecStore):
            # Its own method asks whether the key exists, and then writes.
            path = f"{self.store.path.rstrip('/')}/{key}"
            creation: Coroutine[Any, Any, Any] = self.store.fs._pipe_file(
                path, content, mode="create"
            )
            return creation
        return self.store.set_if_not_exists(key, _buffers().buffer.from_bytes(content))

    def remove(self, key: str) -> None:
        """Remove a key, which may be missing."""
        with self.name_errors(key):
            _run(self.store.delete(key))

    def list_keys(self) -> set[str]:
        """Return all keys, without the temporary files of other processes."""
        if isinstance(self.store, _zarr().storage.FsspecStore):
            # Another process may have written since this one listed them.
            self.store.fs.invalidate_cache()

        async def collect() -> set[str]:
            return {
                key
                async for key in self.store.list()
                if not _PARTIAL.fullmatch(key.rpartition("/")[2])
            }

        with self.name_errors():
            keys: set[str] = _run(collect())
        return keys

    @contextmanager
    def name_errors(self, key: str = "") -> Iterator[None]:
        """Name the store and the key in the error of a read or a write that failed."""
        where = f"{self.name}/{key}" if key else self.name
        try:
            yield
        except OSError as error:
            if error.errno is None:
                raise OSError(f"{where}: {error}") from error
            # A full disk names no file.
            error.filename = error.filename or where
            raise
        except Exception as error:
            if self.folder is not None or isinstance(error, MemoryError):
                raise
            # Libraries of clouds have exceptions of their own, such as for missing credentials.
            raise OSError(f"{where}: {error or type(error).__name__}") from error

    def check_writable(self) -> None:
        """Raise ValueError for a store in which keys cannot be written, removed or listed."""
        store = self.store
        able = store.supports_writes and store.supports_deletes and store.supports_listing
        if store.read_only or not able:
            raise ValueError(f"store: {self.name} cannot write, remove and list keys")

    def check_shared(self) -> None:
        """Raise ValueError for a store that is in the memory of this process."""
        is_here = isinstance(self.store, _zarr().storage.MemoryStore)
        is_here |= "memory" in _protocols(self.store)
        try:
            pickle.dumps(self.store)
        except Exception:
            # Libraries raise errors of different types.
            is_here = True
        if is_here:
            raise ValueError(
                f"store: {self.name} is in this process alone, so that the client's workers cannot "
                "write it; name a folder or a URL that they share"
            )

    def remove_partial(self, keys: Iterable[str]) -> None:
        """Remove temporary files, beside these keys, of processes that were killed while writing.

        Other files may be anybody's.
        """
        folder = self.folder
        for parent in {(folder / key).parent for key in keys} if folder else ():
            for path in parent.glob("*.partial"):
                if _PARTIAL.fullmatch(path.name):
                    path.unlink(missing_ok=True)


def _protocols(store: object) -> tuple[str, ...]:
    """Return the protocols of the file system of an FsspecStore; none for other stores."""
    protocols = getattr(getattr(store, "fs", None), "protocol", ())
    return (protocols,) if isinstance(protocols, str) else tuple(protocols)


def open_keys(store: object) -> Keys:
    """Open the store of a grid: the path of a folder, a URL of fsspec, or a Zarr store.

    Nothing is read or written.
    """
    zarr = _zarr()
    name = str(store)
    if isinstance(store, str) and "://" in store:
        store = _store_of(store)
    if isinstance(store, str | os.PathLike):
        store = zarr.storage.LocalStore(Path(store))
    if isinstance(store, zarr.storage.LocalStore):
        folder = store.root.absolute()
        return Keys(zarr.storage.LocalStore(folder, read_only=store.read_only), str(folder))
    if not isinstance(store, zarr.abc.store.Store):
        raise TypeError(f"store: {store!r} is not a path, a URL or a Zarr store")
    return Keys(store, name)


def _store_of(url: str) -> Any:
    """Return the store of a URL."""
    zarr = _zarr()
    try:
        store = zarr.storage.FsspecStore.from_url(url)
    except ImportError as error:
        # fsspec names the package.
        hint = ": pip install vkbloom[cloud]" if url.startswith(("s3:", "s3a:")) else ""
        raise ImportError(f"store: {url}: {error}{hint}") from error
    except ValueError as error:
        raise ValueError(f"store: {url}: {error}") from error
    if "file" in _protocols(store):
        # LocalStore writes each key at once; a file system of fsspec does not.
        return zarr.storage.LocalStore(store.path)
    return store
