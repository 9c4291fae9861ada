"""Find the driver manifests that the Vulkan loader reads, and check whether their libraries open.

Sources: the Vulkan loader's documentation: LoaderDriverInterface.md for the search order and the
manifests, LoaderInterfaceArchitecture.md for the environment variables.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from vkbloom.doctor import child
from vkbloom.doctor.finding import Finding

INSTALL_DRIVER: Final = (
    "Install lavapipe, which runs on any CPU (the package vkbloom-lavapipe, or Debian, Ubuntu: apt "
    "install mesa-vulkan-drivers; Fedora: dnf install mesa-vulkan-drivers; Arch: pacman -S "
    "vulkan-swrast), or the Vulkan driver of the GPU's vendor."
)
# First loader version that reads VK_DRIVER_FILES; earlier ones read VK_ICD_FILENAMES only.
_FIRST_WITH_DRIVER_FILES: Final = (1, 3, 207)
_FOLDER: Final = "vulkan/icd.d"


@dataclass(frozen=True)
class _Listed:
    """A manifest, and the folder or variable in which the loader finds it."""

    path: Path
    origin: str


def _split(value: str) -> list[Path]:
    return [Path(part) for part in value.split(os.pathsep) if part]


def _set_to(variable: str, default: str) -> list[Path]:
    """Return the paths of an environment variable, or the default if it is empty or not set."""
    return _split(os.environ.get(variable) or default)


def _standard_folders() -> list[Path]:
    home = os.path.expanduser("~")
    bases = [
        *_set_to("XDG_CONFIG_HOME", f"{home}/.config"),
        *_set_to("XDG_CONFIG_DIRS", "/etc/xdg"),
        # The usual values of SYSCONFDIR and EXTRASYSCONFDIR in loader builds.
        Path("/usr/local/etc"),
        Path("/etc"),
        *_set_to("XDG_DATA_HOME", f"{home}/.local/share"),
        *_set_to("XDG_DATA_DIRS", "/usr/local/share:/usr/share"),
    ]
    return list(dict.fromkeys(base / _FOLDER for base in bases))


def _replacing_variable(loader_version: tuple[int, ...] | None) -> str | None:
    """Return the name of the set variable that replaces the standard folders, or None."""
    knows_new_name = loader_version is None or loader_version >= _FIRST_WITH_DRIVER_FILES
    if knows_new_name and "VK_DRIVER_FILES" in os.environ:
        return "VK_DRIVER_FILES"
    return "VK_ICD_FILENAMES" if "VK_ICD_FILENAMES" in os.environ else None


def _from_variable(name: str) -> Iterator[_Listed]:
    """List the manifests of a variable, which may name files and folders of manifests."""
    for path in _split(os.environ.get(name, "")):
        manifests = _manifests(path)
        yield from (_Listed(manifest, name) for manifest in manifests or [path])


def _manifests(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if path.suffix == ".json")
    except OSError:
        return []


def _listed(replacing: str | None) -> list[_Listed]:
    if replacing is not None:
        return list(_from_variable(replacing))
    return [
        *_from_variable("VK_ADD_DRIVER_FILES"),
        *(
            _Listed(manifest, str(folder))
            for folder in _standard_folders()
            for manifest in _manifests(folder)
        ),
    ]


def examine(loader_version: tuple[int, ...] | None) -> list[Finding]:
    """Examine every driver manifest, in the loader's order."""
    if sys.platform == "win32":
        return [
            Finding("drivers", "note", "not examined: on Windows the registry lists the drivers")
        ]
    replacing = _replacing_variable(loader_version)
    listed = _listed(replacing)
    findings = [_search(replacing, listed)]
    if "VK_DRIVER_FILES" in os.environ and replacing != "VK_DRIVER_FILES":
        version = ".".join(map(str, loader_version or ()))
        findings.append(
            Finding(
                "drivers",
                "note",
                f"VK_DRIVER_FILES is set, but the loader {version} ignores it",
                "Set VK_ICD_FILENAMES to the same value.",
            )
        )
    return findings + [_manifest(entry) for entry in listed]


def _search(replacing: str | None, listed: list[_Listed]) -> Finding:
    count = f"{len(listed)} manifest" + ("" if len(listed) == 1 else "s")
    if replacing is None:
        folders = list(map(str, _standard_folders()))
        if "VK_ADD_DRIVER_FILES" in os.environ:
            folders.insert(0, "VK_ADD_DRIVER_FILES")
        if listed:
            origins = dict.fromkeys(entry.origin for entry in listed)
            return Finding("drivers", "ok", f"{count} in {', '.join(origins)}")
        return Finding(
            "drivers",
            "problem",
            f"no manifest of a Vulkan driver was found in {', '.join(folders)}",
            INSTALL_DRIVER,
        )
    value = os.environ[replacing]
    if listed:
        return Finding(
            "drivers",
            "note",
            f"{replacing} is set: the loader uses its {count} and no other driver",
        )
    return Finding(
        "drivers",
        "problem",
        f"{replacing} is {value!r}: the loader finds no driver there and searches nowhere else",
        f"Unset {replacing}, or set it to the full path of a driver's manifest.",
    )


def _manifest(entry: _Listed) -> Finding:
    """Examine one manifest."""
    path = entry.path
    topic = f"driver {path.name}"
    try:
        library, arch = _read(path)
    except OSError as error:
        return Finding(
            topic,
            "problem",
            f"{path}, from {entry.origin}, cannot be read: {error.strerror}",
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
