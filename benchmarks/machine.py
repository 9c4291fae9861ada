"""The machine that a benchmark ran on."""

from __future__ import annotations

import datetime
import os
import platform
import shlex
from pathlib import Path
from typing import Any

import numpy as np

import vkbloom
from benchmarks import peers
from benchmarks.plan import Plan, usable_cores

__all__ = ["describe"]


def describe(plan: Plan, adapter: vkbloom.AdapterInfo | None) -> dict[str, Any]:
    """Return what the figures depend on, as plain values for JSON.

    Parameters
    ----------
    plan : Plan
    adapter : AdapterInfo or None
        The adapter that the benchmarks used.
    """
    return {
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "command": command(plan),
        "adapter": None if adapter is None else adapter.name,
        "adapter type": None if adapter is None else adapter.type,
        "driver": None if adapter is None else f"{adapter.driver} {adapter.driver_info}".strip(),
        "Vulkan": None if adapter is None else adapter.api_version,
        "CPU": _cpu_model(),
        "cores": usable_cores(),
        "load before": _load(),
        "system": f"{platform.system()} {platform.machine()}, {_distribution()}",
        "Python": platform.python_version(),
        "vkbloom": vkbloom.__version__,
        "numpy": np.__version__,
        "peers": peers.versions(),
        "threads of the peers": plan.threads,
    }


def command(plan: Plan) -> str:
    """Return the command line that runs a plan."""
    words = ["python", "-m", "benchmarks"]
    if plan.adapter != "auto":
        words += ["--adapter", plan.adapter]
    for name in plan.only:
        words += ["--only", name]
    if plan.quick:
        words.append("--quick")
    if plan.rounds is not None:
        words += ["--rounds", str(plan.rounds)]
    if plan.seconds != Plan.seconds:
        words += ["--seconds", f"{plan.seconds:g}"]
    if plan.requests != Plan.requests:
        words += ["--requests", str(plan.requests)]
    if plan.threads != usable_cores():
        words += ["--threads", str(plan.threads)]
    return shlex.join(words)


def _cpu_model() -> str:
    """Return the model with its widest vectors, which some hosts' names of models do not tell."""
    found: dict[str, str] = {}
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            name, _, value = line.partition(":")
            found.setdefault(name.strip(), value.strip())
    except OSError:
        pass
    model = found.get("model name") or platform.processor() or platform.machine()
    flags = found.get("flags", "").split()
    names = {"avx512f": "AVX-512", "avx2": "AVX2"}
    return next((f"{model} with {names[flag]}" for flag in names if flag in flags), model)


def _load() -> float | None:
    """Return the load average of the last minute; other processes disturb the figures."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def _distribution() -> str:
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        return platform.release()
