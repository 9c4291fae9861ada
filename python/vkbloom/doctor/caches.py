"""Check the caches: vkbloom's pipelines and kernels, and the driver's."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from vkbloom.doctor.finding import Finding
from vkbloom.io import kernel_cache, pipeline_cache

__all__ = ["drivers", "kernels", "pipelines"]

_WARM: Final = "vkbloom warm fills it."


def _why_not_writable(folder: Path) -> str:
    """Return why no file can be created in a folder; "" if one can."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        return f"{existing} is not a folder"
    try:
        # The folder is created with its first file; creating it here would leave it behind.
        with tempfile.TemporaryDirectory(dir=existing):
            return ""
    except OSError as error:
        return f"{existing}: {error.strerror or error}"


def pipelines(driver_uuids: Collection[str]) -> Finding:
    """Examine vkbloom's own cache.

    `driver_uuids`: UUIDs of the installed drivers, in hexadecimal.
    """
    topic = "pipeline cache"
    try:
        folder = pipeline_cache.folder()
        if folder is None:
            return Finding(topic, "note", "off: VKBLOOM_CACHE_DIR is empty")
        reason = _why_not_writable(folder)
        files = sorted(folder.glob("pipelines-*.bin")) if folder.is_dir() else []
        states = [_cache_file(file, driver_uuids) for file in files]
    except OSError as error:
        return Finding(
            topic,
            "note",
            f"cannot be examined: {error}",
            "Set VKBLOOM_CACHE_DIR to a readable and writable folder.",
        )
    found = "; ".join([str(folder), *states] if states else [str(folder), "no file yet"])
    if reason:
        return Finding(
            topic,
            "note",
            f"{found}; not writable ({reason}): every new process compiles its pipelines again",
            "Set VKBLOOM_CACHE_DIR to a writable folder, or to an empty value for no cache.",
        )
    if any("damaged" in state for state in states):
        return Finding(
            topic,
            "note",
            found,
            "Nothing to do: a damaged file is ignored, and the next render of its driver replaces "
            "it.",
        )
    return Finding(topic, "ok", found)


def _cache_file(file: Path, driver_uuids: Collection[str]) -> str:
    """Describe one cache file."""
    uuid = file.stem.removeprefix("pipelines-")
    try:
        is_complete = pipeline_cache.read(bytes.fromhex(uuid)) is not None
    except ValueError:
        return f"{file.name} is not a file of vkbloom"
    if not is_complete:
        return f"{file.name} is damaged or cannot be read"
    whose = "an installed driver" if uuid in driver_uuids else "a driver that is not installed"
    return f"{file.name} ({file.stat().st_size} bytes, intact, of {whose})"


def kernels() -> Iterator[Finding]:
    """Examine the cache of convolutions' kernels, which is in the folder of `pipelines`."""
    folder = kernel_cache.folder()
    if folder is not None:
        yield _files("kernel cache", "VKBLOOM_CACHE_DIR", folder, "*")


def drivers(adapters: Collection[Mapping[str, Any]]) -> Iterator[Finding]:
    """Examine the drivers' caches, which hold what takes most of the time of a first call."""
    descriptions = [f"{adapter['name']} {adapter['driver_info']}" for adapter in adapters]
    if any("Mesa" in one for one in descriptions):
        off = os.environ.get("MESA_SHADER_CACHE_DISABLE", "").lower() in ("1", "true", "yes", "y")
        yield _driver_cache("Mesa's cache", "MESA_SHADER_CACHE_DIR", off, "mesa_shader_cache*")
    if any("NVIDIA" in one for one in descriptions):
        off = os.environ.get("__GL_SHADER_DISK_CACHE") == "0"
        yield _driver_cache("NVIDIA's cache", "__GL_SHADER_DISK_CACHE_PATH", off, "nvidia/GLCache")


def _driver_cache(topic: str, variable: str, off: bool, pattern: str) -> Finding:
    """Examine a driver's cache: the folders that match a pattern below the user's cache folder."""
    if off:
        return Finding(topic, "note", "off by the environment: every new process compiles again")
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return _files(topic, variable, Path(os.environ.get(variable) or home), f"{pattern}/**/*")


def _files(topic: str, variable: str, base: Path, pattern: str) -> Finding:
    """Examine the files of a cache: those in a folder that match a pattern."""
    try:
        reason = _why_not_writable(base)
        files = [file for file in base.glob(pattern) if file.is_file()]
        size = sum(file.stat().st_size for file in files)
    except OSError as error:
        return Finding(topic, "note", f"cannot be examined: {error}", f"Set {variable}.")
    found = f"{base}; {len(files)} files, {size} bytes" if files else f"{base}; no file yet"
    if reason:
        advice = f"Set {variable} to a writable folder."
        return Finding(topic, "note", f"{found}; not writable ({reason})", advice)
    return Finding(topic, "ok", found, "" if files else _WARM)
