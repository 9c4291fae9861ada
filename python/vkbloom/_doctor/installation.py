"""Check the installation: memory, environment variables, extras, GPU device files and caches."""

from __future__ import annotations

import os
import platform
import re
import tempfile
from collections.abc import Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from vkbloom import _core
from vkbloom._free_memory import ADVICE, free_address_space
from vkbloom._io import disk_cache

# Address space of a render of a small image on lavapipe, with the interpreter.
_AMPLE: Final = 1 << 30
# Of the project, in no registry yet; and Debian's packages of the same programs.
_UNPUBLISHED: Final = {
    "vkbloom-lavapipe": "mesa-vulkan-drivers",
    "vkbloom-glslang": "glslang-tools",
}
# Variables of the loader, Mesa and vkbloom that change the rendering or choose the device.
_VARIABLES = re.compile(r"(VK|VKBLOOM|LP|MESA|__GL|GALLIVM|LIBGL|NODEVICE|(DIS|EN)ABLE_LAYER)_\w+")


class Finding(NamedTuple):
    """The result of one check.

    - `topic`: What was checked, in one or two words.
    - `status`: "ok": correct; "note": information, nothing is broken; "problem": must be repaired.
    - `found`: What was found, and what it means.
    - `advice`: What to do; "" if nothing has to be done.
    """

    topic: str
    status: str
    found: str
    advice: str = ""


class Report(NamedTuple):
    """The findings of one examination; at least one adapter rendered correctly if `can_render`."""

    findings: tuple[Finding, ...]
    can_render: bool


def package() -> Finding:
    """Return the versions of vkbloom, Python, NumPy and the platform."""
    text = f"version {metadata.version('vkbloom')}, Python {platform.python_version()}, NumPy "
    return Finding("vkbloom", "ok", f"{text}{np.__version__}, {platform.platform()}")


def core() -> list[Finding]:
    """Report a core that cannot be loaded, as in the wheel for all systems."""
    if not (reason := getattr(_core, "absence", "")):
        return []
    text = f"it cannot be loaded: {reason}; laws and the reference work, and nothing renders"
    advice = "Install the wheel for this system (Linux), or build vkbloom from its source."
    return [Finding("core", "problem", text, advice)]


def memory() -> list[Finding]:
    """Report a limit of address space under which drivers fail or crash."""
    left = free_address_space()
    if left is None or left >= _AMPLE:
        return []
    text = f"memory is short: a limit leaves {left >> 20} MiB of address space to each process"
    text += f"; a driver and a test render need up to {_AMPLE >> 20} MiB, and may crash with less"
    return [Finding("memory", "problem", text, f"To render: {ADVICE}.")]


def memory_advice() -> str:
    """Return what to do first about a driver that fails where memory is short; "" elsewhere."""
    return "Raise the limit of memory first (ulimit -v)." if memory() else ""


def environment() -> list[Finding]:
    """Report the set environment variables that change the rendering or choose the device."""
    variables = sorted(name for name in os.environ if _VARIABLES.fullmatch(name))
    listed = ", ".join(f"{name}={os.environ[name]}" for name in variables)
    text = f"these variables change the rendering or choose the device: {listed}"
    return [Finding("environment", "note", text)] if variables else []


def extras() -> list[Finding]:
    """Return one finding for each optional extra of the package."""
    needed: dict[str, list[str]] = {}
    for requirement in metadata.requires("vkbloom") or []:
        parts = re.match(r"([\w.-]+).*extra == [\"']([\w-]+)[\"']", requirement)
        # The others are for work on the package, or stand for several.
        if parts and parts[2] not in ("all", "test", "docs", "lint"):
            needed.setdefault(parts[2], []).append(parts[1])
    return [_extra(*item) for item in needed.items()]


def _extra(name: str, distributions: list[str]) -> Finding:
    missing = [
        distribution
        for distribution in distributions
        if not any(metadata.distributions(name=distribution))
    ]
    if missing:
        advice = f"To use it: pip install 'vkbloom[{name}]'"
        if missing[0] in _UNPUBLISHED:
            package = _UNPUBLISHED[missing[0]]
            advice = f"To use it: apt install {package}; or {install_wheel(missing[0])}."
        return Finding(f"extra {name}", "note", f"missing: {', '.join(missing)}", advice)
    return Finding(f"extra {name}", "ok", ", ".join(distributions))


def install_wheel(distribution: str) -> str:
    """Return how to install a package of the project that no registry has."""
    wheel = f"{distribution.replace('-', '_')}-*_{platform.machine()}.whl"
    return f"in a clone of vkbloom, as root, make wheels, then pip install dist/{wheel}"


def gpu_nodes(adapters: Iterable[Mapping[str, Any]]) -> list[Finding]:
    """Examine the device files of GPUs, which Linux has, if none of the adapters is a GPU."""
    nodes = sorted([*Path("/dev/dri").glob("renderD*"), *Path("/dev").glob("nvidia[0-9]*")])
    if not nodes or any(adapter["type"] != "cpu" for adapter in adapters):
        return []
    text = f"{', '.join(map(str, nodes))}, but no Vulkan adapter that uses it"
    advice = "Install the Vulkan driver of the GPU's vendor. In a container, mount the driver."
    if all(os.access(node, os.R_OK | os.W_OK) for node in nodes):
        return [Finding("GPU", "note", text, advice)]
    advice = 'Add this user to the group that owns it, often "render" or "video".'
    return [Finding("GPU", "problem", f"{text}: this user cannot open it", advice)]


def caches() -> list[Finding]:
    """Examine whether the caches of vkbloom and of the drivers can be written."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    drivers = ("MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH")
    results = [_cache("VKBLOOM_CACHE_DIR", disk_cache.folder())]
    return results + [_cache(name, os.environ.get(name) or home) for name in drivers]


def _cache(variable: str, folder: str | Path | None) -> Finding:
    topic = f"cache {variable}"
    if folder is None:
        return Finding(topic, "note", "off: the variable is empty")
    existing = next(path for path in (Path(folder), *Path(folder).parents) if path.exists())
    try:
        # The folder is created with its first file; creating it here would leave it behind.
        with tempfile.TemporaryDirectory(dir=existing):
            return Finding(topic, "ok", f"{folder}, writable")
    except OSError as error:
        text = f"{folder} is not writable ({existing}: {error.strerror or error})"
        advice = f"Set {variable} to a writable folder, or each process compiles again."
        return Finding(topic, "note", text, advice)
