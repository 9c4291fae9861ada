"""Check the driver manifests that the Vulkan loader reads: its log tells where it searches.

Sources: the Vulkan loader's documentation: LoaderDebugging.md for the log, and
LoaderDriverInterface.md for manifests and environment variables.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from vkbloom.doctor import child
from vkbloom.doctor.finding import Finding

#: The environment in which the loader writes its log to standard error.
LOG: Final = {"VK_LOADER_DEBUG": "all"}
INSTALL_DRIVER: Final = (
    "Install lavapipe, which runs on any CPU (the package vkbloom-lavapipe, or Debian, Ubuntu: apt "
    "install mesa-vulkan-drivers; Fedora: dnf install mesa-vulkan-drivers; Arch: pacman -S "
    "vulkan-swrast), or the Vulkan driver of the GPU's vendor."
)
# Either replaces the standard folders; older loaders know only the second one.
_REPLACING: Final = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")
_LOCATIONS: Final = "In following locations:"
_FILES: Final = "Found the following files:"


def complaints(messages: Sequence[str]) -> list[str]:
    """Return what processes said besides the information in the loader's log."""
    return [one for one in messages if not re.match(r"(INFO|DEBUG|DRIVER|LAYER|PERF)\b", one)]


def _searched(log: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return where the loader searched for manifests of drivers, and the files that it found."""
    found: dict[str, dict[str, None]] = {_LOCATIONS: {}, _FILES: {}}
    is_of_drivers, part = False, ""
    for line in log:
        kind, _, text = line.partition(":")
        text = text.strip()
        if text.startswith("Searching for ") and text.endswith("manifest files"):
            is_of_drivers, part = "driver" in text, ""
        elif text in found:
            part = text
        elif kind != "DRIVER" or text.startswith("Found "):
            part = ""
        elif is_of_drivers and part:
            found[part][text] = None
    return list(found[_LOCATIONS]), list(found[_FILES])


def examine(log: Sequence[str]) -> list[Finding]:
    """Examine every driver manifest that the loader's log names, in its order."""
    if sys.platform == "win32":
        return [
            Finding("drivers", "note", "not examined: on Windows the registry lists the drivers")
        ]
    locations, files = _searched(log)
    replacing = None
    for name in _REPLACING:
        named = os.environ.get(name, "").split(os.pathsep)
        if name in os.environ and log and set(locations) <= set(named):
            replacing = name
            break
    findings = [_search(replacing, locations, files)]
    if "VK_DRIVER_FILES" in os.environ and locations and replacing != "VK_DRIVER_FILES":
        findings.append(
            Finding(
                "drivers",
                "note",
                "VK_DRIVER_FILES is set, but this loader ignores it",
                "Set VK_ICD_FILENAMES to the same value.",
            )
        )
    return findings + [manifest(Path(file), replacing) for file in files]


def _search(replacing: str | None, locations: list[str], files: list[str]) -> Finding:
    count = f"{len(files)} manifest" + ("" if len(files) == 1 else "s")
    if replacing and files:
        return Finding(
            "drivers",
            "note",
            f"{replacing} is set: the loader uses its {count} and no other driver",
        )
    if replacing:
        return Finding(
            "drivers",
            "problem",
            f"{replacing} is {os.environ[replacing]!r}: the loader finds no driver there and "
            "searches nowhere else",
            f"Unset {replacing}, or set it to the full path of a driver's manifest.",
        )
    if files:
        folders = dict.fromkeys(str(Path(file).parent) for file in files)
        return Finding("drivers", "ok", f"{count} in {', '.join(folders)}")
    if not locations:
        return Finding("drivers", "note", "the loader's log does not tell where it searches")
    return Finding(
        "drivers",
        "problem",
        f"no manifest of a Vulkan driver was found in {', '.join(locations)}",
        INSTALL_DRIVER,
    )


def manifest(path: Path, origin: str | None = None) -> Finding:
    """Examine one manifest; `origin`: the environment variable that names it."""
    topic = f"driver {path.name}"
    try:
        library, arch = _read(path)
    except OSError as error:
        return Finding(
            topic,
            "problem",
            f"{path}, from {origin or path.parent}, cannot be read: {error.strerror}",
            "Make the manifest readable, or remove it from there.",
        )
    except ValueError as error:
        return Finding(
            topic,
            "problem",
            f"{path} is damaged: {error}; some loaders then find no driver at all and report "
            "VK_ERROR_OUT_OF_HOST_MEMORY",
            "Remove the file, or install its driver again.",
        )
    pointer_bits = "64" if sys.maxsize > 2**32 else "32"
    if arch not in ("", pointer_bits):
        return Finding(topic, "note", f"{path} is for {arch}-bit programs; ignored")
    failure = child.why_driver_does_not_open(library)
    if not failure:
        return Finding(topic, "ok", f"{path}: {library} opens")
    if "wrong ELF class" in failure:
        return Finding(topic, "note", f"{path} is for another architecture; ignored")
    return Finding(
        topic,
        "problem",
        f"{path}: its library does not open: {failure}",
        "Install the driver again, or remove the manifest.",
    )


def _read(path: Path) -> tuple[str, str]:
    """Return the library, as a path or name to open, and the architecture of a manifest."""
    try:
        content: Any = json.loads(path.read_bytes())
    except UnicodeDecodeError:
        raise ValueError("it is not text") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"line {error.lineno} is not JSON ({error.msg})") from None
    except RecursionError:
        raise ValueError("its JSON is nested too deeply") from None
    driver = content.get("ICD") if isinstance(content, dict) else None
    if not isinstance(driver, dict):
        raise ValueError('it has no object "ICD"')
    library = driver.get("library_path")
    if not isinstance(library, str) or not library or "\0" in library:
        raise ValueError('its "ICD" has no "library_path"')
    # The system searches for a bare file name; a relative path starts at the manifest's folder.
    if "/" in library:
        library = str(path.parent / library)
    return library, str(driver.get("library_arch", ""))
