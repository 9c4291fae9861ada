"""The cache on disk: what took long to compute, for the next process.

A file is used only if its checksum is right for its content and its key. It is written atomically.
The cache only saves time, so failing to write a file is not an error. All files of a kind have
`DiskCache.max_bytes` at most; the least recently used ones are removed.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from pathlib import Path

from vkbloom._io.safe_writing import write_file

MAGIC = b"vkbloom cache 1\n"
_DIGEST_SIZE = 32
HEADER_SIZE = len(MAGIC) + _DIGEST_SIZE
# Of `DiskCache.file`.
_NAME = re.compile(r"(?:[0-9a-f]{2}){1,64}\.bin")


def folder() -> Path | None:
    """Return the folder of the cache; None if VKBLOOM_CACHE_DIR is empty.

    Default: the user's cache folder. The environment variable VKBLOOM_CACHE_DIR overrides it.
    """
    chosen = os.environ.get("VKBLOOM_CACHE_DIR")
    if chosen is not None:
        return Path(chosen) if chosen else None
    with contextlib.suppress(RuntimeError):  # no home folder: no cache
        cache = Path(os.environ.get("XDG_CACHE_HOME", ""))
        # The XDG Base Directory Specification says to ignore relative paths.
        return (cache if cache.is_absolute() else Path.home() / ".cache") / "vkbloom"
    return None


def header(key: bytes, data: bytes | memoryview) -> bytes:
    """Return the beginning of a file, before its data."""
    return MAGIC + hashlib.blake2b(data, key=key, digest_size=_DIGEST_SIZE).digest()


class DiskCache:
    """The files of one kind, in a folder of that name: bytes by a key of up to 64 bytes."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        #: The bound of all files. A process writes no more than that in total, so that a long sweep
        #: does not replace the files of other processes again and again.
        self.max_bytes = 256 << 20
        self.written: dict[bytes, int] = {}

    def file(self, key: bytes) -> Path | None:
        """Return the file of a key; None without a cache."""
        base = folder()
        return None if base is None else base / self._kind / f"{key.hex()}.bin"

    def read(self, key: bytes) -> bytes | None:
        """Return the data of a key; None if its file is missing, damaged or another key's."""
        file = self.file(key)
        if file is None:
            return None
        try:
            content = file.read_bytes()
            data = content[HEADER_SIZE:]
            if content[:HEADER_SIZE] != header(key, data):
                return None
            # The time of its last use.
            os.utime(file)
        except OSError:
            return None
        return data

    def write(self, key: bytes, data: bytes) -> None:
        """Write or replace the file of a key, if that is possible."""
        file, written = self.file(key), {**self.written, key: HEADER_SIZE + len(data)}
        if file is None or sum(written.values()) > self.max_bytes:
            return
        with contextlib.suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            write_file(file, header(key, data) + data)
            self.written = written
            self._remove_oldest(file.parent)

    def _remove_oldest(self, base: Path) -> None:
        states = []
        with os.scandir(base) as entries:
            for entry in entries:
                # Other files may be anybody's: users name the folder.
                if _NAME.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                    state = entry.stat()
                    states.append((state.st_mtime_ns, state.st_size, Path(entry.path)))
        total = sum(size for _, size, _ in states)
        for _, size, file in sorted(states):
            if total <= self.max_bytes:
                return
            total -= size
            if _is_written(file):
                file.unlink(missing_ok=True)


def _is_written(file: Path) -> bool:
    """Return whether a file begins as those of the cache."""
    with file.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC
