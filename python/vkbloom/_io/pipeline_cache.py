"""The Vulkan pipeline cache on disk: one file per driver in the user's cache folder.

A file is used only if its checksum is right for its content and driver; otherwise it is replaced.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import tempfile
from pathlib import Path

MAGIC = b"vkbloom pipelines 1\n"
_DIGEST_SIZE = hashlib.sha256().digest_size


def folder() -> Path | None:
    """Return the folder of the cache files; None if VKBLOOM_CACHE_DIR is empty.

    Default: the user's cache folder. The environment variable VKBLOOM_CACHE_DIR overrides it.
    """
    chosen = os.environ.get("VKBLOOM_CACHE_DIR")
    if chosen is not None:
        return Path(chosen) if chosen else None
    with contextlib.suppress(RuntimeError):  # no home folder: no cache
        if sys.platform == "win32":
            local = os.environ.get("LOCALAPPDATA")
            return (Path(local) if local else Path.home() / "AppData/Local") / "vkbloom"
        if sys.platform == "darwin":
            return Path.home() / "Library/Caches/vkbloom"
        cache = Path(os.environ.get("XDG_CACHE_HOME", ""))
        # The XDG Base Directory Specification says to ignore relative paths.
        return (cache if cache.is_absolute() else Path.home() / ".cache") / "vkbloom"
    return None


def path(driver_uuid: bytes) -> Path | None:
    """Return the cache file of a driver; None without a folder."""
    base = folder()
    return None if base is None else base / f"pipelines-{driver_uuid.hex()}.bin"


def read(driver_uuid: bytes) -> bytes | None:
    """Return a driver's cached data; None if its file is missing, damaged or of another driver."""
    file = path(driver_uuid)
    if file is None:
        return None
    try:
        content = file.read_bytes()
    except OSError:
        return None
    return unwrap(content, driver_uuid)


def digest(driver_uuid: bytes, data: bytes) -> bytes:
    """Return the checksum of a driver's cache file."""
    return hashlib.sha256(driver_uuid + data).digest()


def unwrap(content: bytes, driver_uuid: bytes) -> bytes | None:
    """Return the data of a cache file; None if it is damaged or of another driver."""
    header = len(MAGIC) + _DIGEST_SIZE
    data = content[header:]
    if content[:header] != MAGIC + digest(driver_uuid, data):
        return None
    return data


def write(driver_uuid: bytes, data: bytes) -> None:
    """Replace a driver's cache file atomically.

    The cache only saves time, so failing to write it is not an error.
    """
    file = path(driver_uuid)
    if file is None:
        return
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=file.parent, prefix=file.name)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(MAGIC + digest(driver_uuid, data) + data)
            os.replace(temporary, file)
        except BaseException:
            os.unlink(temporary)
            raise
