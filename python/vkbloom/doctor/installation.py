"""Check the installation: environment variables, pipeline cache, extras and GPU device files."""

from __future__ import annotations

import os
import platform
import re
import sys
import tempfile
from collections.abc import Collection
from importlib import metadata
from pathlib import Path
from typing import Final

import numpy as np

from vkbloom.doctor.finding import Finding, Status
from vkbloom.free_memory import ADVICE, address_space_left
from vkbloom.io import pipeline_cache

# Purpose of each extra; the distributions that it needs are read from the metadata.
_EXTRAS: Final = {
    "images": "image files: Frames.save, apply on files",
    "scenes": "glTF scenes and skyboxes",
    "grid": "to_xarray and grids of settings",
    "cli": "the command line",
    "software": "a bundled driver that renders on any CPU",
    "quality": "quality figures such as SSIM",
    "fit": "settings that give a picture: fit, translate, fit_pyramid",
    "cvvdp": "the reduction ColorVideoVDP",
    "notebook": "the explorer, in notebooks and as a web page",
    "pytest": "frame_regression in tests",
    "torch": "bloom as an operator of PyTorch",
    "window": "vkbloom view, a window with live controls",
}
# Address space of a render of a small image on lavapipe, with the interpreter.
_AMPLE: Final = 1 << 30
# Variables of the loader, Mesa and vkbloom that change the rendering or choose the device.
_RELEVANT_VARIABLES: Final = re.compile(
    r"(VK|VKBLOOM|LP|MESA|GALLIVM|LIBGL|NODEVICE|DISABLE_LAYER|ENABLE_LAYER)_\w+"
)


def package() -> Finding:
    """Return the versions of vkbloom, Python, NumPy and the platform."""
    return Finding(
        "vkbloom",
        "ok",
        f"version {metadata.version('vkbloom')}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, {platform.platform()}",
    )


def memory() -> list[Finding]:
    """Report a limit of address space under which drivers fail or crash."""
    left = address_space_left()
    if left is None or left >= _AMPLE:
        return []
    return [
        Finding(
            "memory",
            "problem",
            f"memory is short: a limit leaves {left >> 20} MiB of address space to each process; "
            f"a driver and a test render need up to {_AMPLE >> 20} MiB, and may crash with less",
            f"To render: {ADVICE}.",
        )
    ]


def environment() -> list[Finding]:
    """Report the set environment variables that change the rendering or choose the device."""
    settings = [
        f"{name}={value}"
        for name, value in sorted(os.environ.items())
        if _RELEVANT_VARIABLES.fullmatch(name)
    ]
    if not settings:
        return []
    return [
        Finding(
            "environment",
            "note",
            f"these variables change the rendering or choose the device: {', '.join(settings)}",
        )
    ]


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


def cache(driver_uuids: Collection[str]) -> Finding:
    """Examine the pipeline cache."""
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


def extras() -> list[Finding]:
    """Return one finding for each optional extra of the package."""
    required = metadata.requires("vkbloom") or []
    return [_extra(name, purpose, required) for name, purpose in _EXTRAS.items()]


def _extra(name: str, purpose: str, required: list[str]) -> Finding:
    present, missing = [], []
    for requirement in required:
        described, _, marker = requirement.partition(";")
        distribution = re.match(r"[\w.-]+", described)
        if distribution is None or not re.search(rf"extra == [\"']{name}[\"']", marker):
            continue
        try:
            present.append(f"{distribution[0]} {metadata.version(distribution[0])}")
        except metadata.PackageNotFoundError:
            missing.append(distribution[0])
    if missing:
        return Finding(
            f"extra {name}",
            "note",
            f"missing: {', '.join(missing)}; needed for {purpose}",
            f"To use it: pip install vkbloom[{name}]",
        )
    return Finding(f"extra {name}", "ok", f"{', '.join(present)}; for {purpose}")


def gpu_nodes(has_gpu_adapter: bool) -> list[Finding]:
    """Examine the device files of GPUs, on Linux."""
    if not sys.platform.startswith("linux"):
        return []
    nodes = sorted([*Path("/dev/dri").glob("renderD*"), *Path("/dev").glob("nvidia[0-9]*")])
    if not nodes:
        return []
    closed = [node for node in nodes if not os.access(node, os.R_OK | os.W_OK)]
    names = ", ".join(map(str, nodes))
    status: Status = "ok" if has_gpu_adapter else "note"
    if closed:
        return [
            Finding(
                "GPU",
                status if has_gpu_adapter else "problem",
                f"{', '.join(map(str, closed))} cannot be opened by this user",
                'Add the user to the group that owns it, often "render" or "video".',
            )
        ]
    if has_gpu_adapter:
        return [Finding("GPU", "ok", f"{names}, and an adapter that uses it")]
    return [
        Finding(
            "GPU",
            "note",
            f"{names}, but no Vulkan adapter that uses it",
            "Install the Vulkan driver of the GPU's vendor. In a container, mount the driver.",
        )
    ]
