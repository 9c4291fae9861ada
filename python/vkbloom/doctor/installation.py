"""What belongs to this package and the machine it is on: cache, optional packages, GPU nodes."""

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
from vkbloom.io import pipeline_cache

# What each extra of the package is for; which distributions it needs is read from the metadata.
_EXTRAS: Final = {
    "images": "image files: Frames.save, apply on files",
    "scenes": "glTF scenes and skyboxes, the built-in saucer too",
    "grid": "to_xarray and grids of settings",
    "cli": "the command line",
    "quality": "quality figures such as SSIM",
    "notebook": "the explorer, in notebooks and on its own page",
    "pytest": "frame_regression in tests",
}
# Variables of the loader, of Mesa and of this package that change what is rendered, or where.
_TELLING_VARIABLES: Final = re.compile(
    r"(VK|VKBLOOM|LP|MESA|GALLIVM|LIBGL|NODEVICE|DISABLE_LAYER|ENABLE_LAYER)_\w+"
)


def package() -> Finding:
    """Return the versions of the package and of what it runs on."""
    return Finding(
        "vkbloom",
        "ok",
        f"version {metadata.version('vkbloom')}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, {platform.platform()}",
    )


def environment() -> list[Finding]:
    """Return the environment variables that change what Vulkan does, if any is set."""
    settings = [
        f"{name}={value}"
        for name, value in sorted(os.environ.items())
        if _TELLING_VARIABLES.fullmatch(name)
    ]
    if not settings:
        return []
    return [
        Finding(
            "environment",
            "note",
            f"set, and of influence on what is rendered or where: {', '.join(settings)}",
        )
    ]


def _why_not_writable(folder: Path) -> str:
    """Return why no file can be made in a folder, "" where one can."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        return f"{existing} is no folder"
    if existing != folder:
        # It is made when the first file is written; trying it would leave it behind.
        return "" if os.access(existing, os.W_OK | os.X_OK) else f"{existing} is not writable"
    try:
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        return error.strerror or str(error)


def cache(driver_uuids: Collection[str]) -> Finding:
    """Examine the pipeline cache.

    Parameters
    ----------
    driver_uuids : collection of str
        Of the drivers that are there, in hexadecimal.

    Returns
    -------
    Finding
    """
    topic = "pipeline cache"
    try:
        folder = pipeline_cache.folder()
        if folder is None:
            return Finding(topic, "note", "off, as VKBLOOM_CACHE_DIR is set to nothing")
        reason = _why_not_writable(folder)
        files = sorted(folder.glob("pipelines-*.bin")) if folder.is_dir() else []
        states = [_cache_file(file, driver_uuids) for file in files]
    except OSError as error:
        return Finding(
            topic,
            "note",
            f"cannot be examined: {error}",
            "Set VKBLOOM_CACHE_DIR to a folder that can be read and written.",
        )
    found = "; ".join([str(folder), *states] if states else [str(folder), "no file yet"])
    if reason:
        return Finding(
            topic,
            "note",
            f"{found}; not writable ({reason}), so every new process compiles its pipelines again",
            "Set VKBLOOM_CACHE_DIR to a folder that can be written, or to nothing for no cache.",
        )
    if any("damaged" in state for state in states):
        return Finding(
            topic,
            "note",
            found,
            "Nothing: a damaged file is not used, and replaced at the next render of its driver.",
        )
    return Finding(topic, "ok", found)


def _cache_file(file: Path, driver_uuids: Collection[str]) -> str:
    """Describe one cache file."""
    uuid = file.stem.removeprefix("pipelines-")
    try:
        whole = pipeline_cache.read(bytes.fromhex(uuid)) is not None
    except ValueError:
        return f"{file.name} is not of vkbloom"
    if not whole:
        return f"{file.name} is damaged or cannot be read"
    whose = "of a driver that is here" if uuid in driver_uuids else "of a driver that is not here"
    return f"{file.name} ({file.stat().st_size} bytes, whole, {whose})"


def extras() -> list[Finding]:
    """Return one finding for each optional extra of the package.

    Returns
    -------
    list of Finding
    """
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
            f"missing: {', '.join(missing)}; for {purpose}",
            f"Where that is wanted: pip install vkbloom[{name}]",
        )
    return Finding(f"extra {name}", "ok", f"{', '.join(present)}; for {purpose}")


def gpu_nodes(has_gpu_adapter: bool) -> list[Finding]:
    """Examine the device files of GPUs, on Linux.

    Parameters
    ----------
    has_gpu_adapter : bool
        Whether Vulkan lists an adapter that is no CPU.

    Returns
    -------
    list of Finding
        None where no GPU shows itself.
    """
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
                'Join the group that owns it, often "render" or "video".',
            )
        ]
    if has_gpu_adapter:
        return [Finding("GPU", "ok", f"{names}, and an adapter that uses it")]
    return [
        Finding(
            "GPU",
            "note",
            f"{names}, but no Vulkan adapter that uses it",
            "Install the Vulkan driver of the GPU's vendor; a container may need it mounted.",
        )
    ]
