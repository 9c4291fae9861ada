"""Check the installation: environment variables, extras and GPU device files."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Final

import numpy as np

from vkbloom.doctor.finding import Finding, Status
from vkbloom.free_memory import ADVICE, address_space_left

# Purpose of each extra; the distributions that it needs are read from the metadata.
_EXTRAS: Final = {
    "images": "image files: Frames.save, apply on files",
    "scenes": "glTF scenes and skyboxes",
    "grid": "to_xarray and grids of settings",
    "cli": "the command line",
    "software": "a bundled driver that renders on any CPU",
    "shaders": "own methods where the system has no glslang",
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
