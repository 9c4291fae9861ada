"""Check the drivers whose manifests the Vulkan loader reads: its log tells where it searches.

Sources: the Vulkan loader's documentation: LoaderDebugging.md for the log, and
LoaderDriverInterface.md for manifests and environment variables.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from vkbloom._doctor import child, installation
from vkbloom._doctor.installation import Finding

#: The environment in which the loader writes its log to standard error.
LOG: Final = {"VK_LOADER_DEBUG": "all"}
INSTALL_DRIVER: Final = (
    "Install lavapipe, which runs on any CPU (apt install mesa-vulkan-drivers, or Arch's "
    f"vulkan-swrast, or {installation.install_wheel('vkbloom-lavapipe')}), or the Vulkan driver "
    "of the GPU's vendor."
)
# Either replaces the standard folders; older loaders know only the second one.
_REPLACING: Final = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")


def names(adapters: Iterable[Mapping[str, Any]]) -> str:
    """Return the names and types of adapters."""
    kinds = (
        (adapter["name"], f"{adapter['type']}{', bundled' * adapter['bundled']}")
        for adapter in adapters
    )
    return ", ".join(f"{name} ({kind})" for name, kind in kinds)


def _lines(log: Sequence[str]) -> list[str]:
    # Loaders from 1.3.275 on write their name before each line.
    return [line.removeprefix("[Vulkan Loader]").lstrip() for line in log]


def complaints(log: Sequence[str]) -> list[str]:
    """Return what processes said besides the information in the loader's log."""
    return [line for line in _lines(log) if not re.match(r"(INFO|DEBUG|DRIVER|LAYER|PERF)\b", line)]


def examine(log: Sequence[str]) -> list[Finding]:
    """Try every driver whose manifest the loader's log names, in its order."""
    searched = re.findall(r"^DRIVER: +(\S.*[/\\].*)$", "\n".join(_lines(log)), re.MULTILINE)
    paths = [path for path in dict.fromkeys(searched) if not path.startswith("Found ")]
    files = [path for path in paths if path.endswith(".json")]
    if files:
        folders = dict.fromkeys(str(Path(file).parent) for file in files)
        text = f"{len(files)} manifests in {', '.join(folders)}"
        return [Finding("drivers", "ok", text), *map(manifest, files)]
    replacing = [name for name in _REPLACING if name in os.environ]
    if not paths and not replacing:
        return [Finding("drivers", "note", "the loader's log does not tell where it searches")]
    where = ", ".join([*paths, *(f"{name}={os.environ[name]}" for name in replacing)])
    advice = f"Unset {' and '.join(replacing)}, or name a driver's manifest by its full path."
    text = f"no manifest of a Vulkan driver was found in {where}"
    return [Finding("drivers", "problem", text, advice if replacing else INSTALL_DRIVER)]


def manifest(file: str) -> Finding:
    """Try one driver: the loader opens it and no other one."""
    topic, advice = f"driver {Path(file).name}", "Install the driver again, or remove the manifest."
    try:
        json.loads(Path(file).read_bytes())["ICD"]["library_path"].encode()
    except OSError as error:
        return Finding(topic, "problem", f"{file} cannot be read: {error.strerror}", advice)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        # Some loaders then find no driver at all and report VK_ERROR_OUT_OF_HOST_MEMORY.
        text = f"{file} is damaged: {type(error).__name__}: {error}"
        return Finding(topic, "problem", text, advice)
    answer = child.ask("adapters", "system", environment=LOG | dict.fromkeys(_REPLACING, file))
    if answer.value is not None:
        return Finding(topic, "ok", f"{file}: {names(answer.value['adapters']) or 'no device'}")
    # The loader says that it found no drivers of one without a device, too.
    said = [line for line in complaints(answer.messages) if "Found no drivers" not in line]
    said = [line for line in said if line.startswith("ERROR") or file in line]
    if not said and answer.failure.startswith("no Vulkan adapter"):
        return Finding(topic, "note", f"{file}: of another architecture, or without a device here")
    advice = installation.memory_advice() or advice
    text = "; ".join([f"{file}: {answer.failure}", *dict.fromkeys(said)])
    return Finding(topic, "problem", text, advice)
