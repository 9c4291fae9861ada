"""Check whether this machine can render, and explain what prevents it.

A fault of the machine raises no exception here: each check returns a `Finding`. Code that opens a
driver runs in a child process (`vkbloom.doctor.child`), so that a driver's crash becomes a finding
too.
"""

from __future__ import annotations

import dataclasses
import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from vkbloom.doctor import caches, child, drivers, installation
from vkbloom.doctor.finding import Finding, Status

__all__ = ["Finding", "Report", "Status", "examine"]

_VALIDATION_LAYER: Final = "VK_LAYER_KHRONOS_validation"
#: Versions of Mesa whose lavapipe the package is tested with.
TESTED_MESA: Final = ("22.3.6", "25.0.7")

# Number of loader messages to quote; a loader with many problems repeats its messages.
_MESSAGES: Final = 6

_INSTALL_LOADER: Final = (
    "Install the Vulkan loader (Debian, Ubuntu: apt install libvulkan1; Fedora: dnf install "
    "vulkan-loader; Arch: pacman -S vulkan-icd-loader), and a driver as well."
)
_INSTALL_LAYER: Final = (
    "To use validation=True: apt install vulkan-validationlayers (Debian, Ubuntu), "
    "dnf install vulkan-validation-layers (Fedora), pacman -S vulkan-validation-layers (Arch)."
)


@dataclass(frozen=True)
class Report:
    """The findings of one examination; at least one adapter rendered correctly if `can_render`."""

    findings: tuple[Finding, ...]
    can_render: bool


def examine() -> Report:
    """Examine everything that rendering needs, and make a test render on each adapter.

    Takes some seconds. The test render adds to the pipeline cache, as every render does.
    """
    loader = child.ask("loader")
    listed = child.ask("adapters", environment=drivers.LOG)
    adapters: list[Mapping[str, Any]] = [] if listed.value is None else listed.value["adapters"]

    chosen = child.ask("render", "auto", "plain")
    renders = {} if chosen.value is None else {chosen.value["name"]: chosen}
    for adapter in adapters:
        if adapter["name"] not in renders:
            renders[adapter["name"]] = child.ask("render", adapter["name"], "plain")
    working = [name for name, answer in renders.items() if answer.value is not None]
    foundation = [_loader(loader), *drivers.examine(listed.messages)]
    if any(adapter["bundled"] for adapter in adapters):
        # The bundled driver needs neither loader nor manifest.
        foundation = [
            dataclasses.replace(finding, status="note") if finding.status == "problem" else finding
            for finding in foundation
        ]
    has_problem = any(finding.status == "problem" for finding in foundation)
    findings = [
        installation.package(),
        *installation.memory(),
        *foundation,
        *installation.environment(),
        _adapters(listed, has_problem),
        *([_software(adapters)] if adapters else []),
        *installation.gpu_nodes(any(adapter["type"] != "cpu" for adapter in adapters)),
        *([_chosen(chosen)] if adapters else []),
        *(_test_render(name, answer) for name, answer in renders.items()),
        *_validation(loader.value and loader.value["layers"], working[0] if working else None),
        caches.pipelines([adapter["driver_uuid"] for adapter in adapters]),
        *caches.kernels(),
        *caches.drivers(adapters),
        *installation.extras(),
    ]
    can_render = any(
        answer.value is not None and not answer.value["differences"] for answer in renders.values()
    )
    return Report(tuple(findings), can_render)


def _loader(loader: child.Answer) -> Finding:
    if loader.value is None:
        return Finding("Vulkan loader", "problem", f"not found: {loader.failure}", _INSTALL_LOADER)
    version, file = loader.value["version"], loader.value["file"] or "place unknown"
    if version.startswith("1.0."):
        return Finding(
            "Vulkan loader",
            "problem",
            f"Vulkan {version}, {file}; at least 1.1 is needed",
            "Install a newer Vulkan loader.",
        )
    return Finding("Vulkan loader", "ok", f"Vulkan {version}, {file}")


def _adapters(listed: child.Answer, has_problem: bool) -> Finding:
    """Judge the list of adapters; `has_problem`: the loader or a driver has a problem."""
    if listed.value and listed.value["adapters"]:
        names = [
            f"{entry['name']} ({entry['type']}{', bundled' if entry['bundled'] else ''})"
            for entry in listed.value["adapters"]
        ]
        return Finding("adapters", "ok", ", ".join(names))
    reason = listed.failure or "no driver has a device with Vulkan 1.1"
    messages = drivers.complaints(listed.messages)
    said = f"; the loader says: {' / '.join(messages[:_MESSAGES])}" if messages else ""
    return Finding(
        "adapters",
        "problem",
        f"none: {reason}{said}",
        "Solve the problems above first."
        if has_problem or installation.memory()
        else drivers.INSTALL_DRIVER,
    )


def _software(adapters: list[Mapping[str, Any]]) -> Finding:
    topic = "lavapipe"
    found = [adapter for adapter in adapters if adapter["type"] == "cpu"]
    # As the choice of "software" has it.
    found.sort(key=lambda adapter: not adapter["bundled"])
    if not found:
        return Finding(
            topic,
            "note",
            'no software adapter was found; adapter="software" fails',
            "To use it: install the package vkbloom-lavapipe, or apt install "
            "mesa-vulkan-drivers (Debian, Ubuntu).",
        )
    described = found[0]["driver_info"]
    tested = " and ".join(TESTED_MESA)
    if "Mesa" not in described:
        return Finding(
            topic,
            "note",
            f"the software adapter is {found[0]['name']}, not lavapipe, whose versions {tested} "
            "are tested; it should work",
            "Check the test render below.",
        )
    # As in "Mesa 22.3.6 (LLVM 15.0.6)"; a distribution may append its own revision.
    version = re.match(r"Mesa ([\d.]+)", described)
    if version and version[1] in TESTED_MESA:
        return Finding(topic, "ok", f"{described}, one of the tested versions ({tested})")
    return Finding(
        topic,
        "note",
        f"{described} is not one of the tested versions ({tested}), but should work",
        "Check the test render below.",
    )


def _chosen(chosen: child.Answer) -> Finding:
    topic = "chosen adapter"
    wanted = os.environ.get("VKBLOOM_ADAPTER")
    if wanted:
        reason = f'VKBLOOM_ADAPTER is {wanted!r} and replaces "auto"'
        advice = "Correct or unset VKBLOOM_ADAPTER."
    else:
        reason = (
            '"auto" prefers discrete, integrated, virtual, cpu, in that order, and any of them to '
            "a driver that is not conformant"
        )
        advice = "Set VKBLOOM_ADAPTER to software, hardware, or a part of another adapter's name."
    if chosen.value is None:
        return Finding(topic, "problem", f"{reason}; it fails: {chosen.failure}", advice)
    return Finding(topic, "ok", f"{chosen.value['summary']}; {reason}")


def _test_render(name: str, answer: child.Answer) -> Finding:
    topic = "test render"
    if answer.value is None:
        return Finding(
            topic,
            "problem",
            f"{name} fails: {answer.failure}",
            "Raise the limit of memory first (ulimit -v)."
            if installation.memory()
            else "Update its driver, or use another adapter.",
        )
    if answer.value["differences"]:
        return Finding(
            topic,
            "problem",
            f"{name} renders wrong values: {'; '.join(answer.value['differences'])}",
            "Update its driver, or use another adapter. Do not trust its framebuffers.",
        )
    milliseconds = 1e3 * sum(answer.value["timings"].values())
    passes = f"{milliseconds:.2f} ms in its passes"
    if math.isnan(milliseconds):
        passes = "the device does not time its passes"
    total = 1e3 * answer.value["seconds"]
    return Finding(
        topic,
        "ok",
        f"{name} renders correctly: all framebuffers are within tolerance of the expected values "
        f"({passes}, {total:.0f} ms with setup)",
    )


def _validation(layers: Mapping[str, str] | None, adapter: str | None) -> Iterator[Finding]:
    """Check the validation layer by a test render on an adapter that works without it."""
    topic = "validation layer"
    if layers is None:
        return
    if _VALIDATION_LAYER not in layers:
        yield Finding(topic, "note", f"{_VALIDATION_LAYER} is not installed", _INSTALL_LAYER)
        return
    version = layers[_VALIDATION_LAYER]
    if adapter is None:
        yield Finding(topic, "ok", f"installed, version {version}; not tried: no adapter renders")
        return
    answer = child.ask("render", adapter, "validated")
    if answer.value is None:
        yield Finding(
            topic,
            "problem",
            f"version {version} is installed, but the test render fails with it: {answer.failure}",
            "Install the layer again, in the loader's version, or do not use validation=True.",
        )
    else:
        yield Finding(topic, "ok", f"version {version}; the test render has no validation errors")
