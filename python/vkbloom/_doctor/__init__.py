"""Check whether this machine can render, and explain what prevents it.

A fault of the machine raises no exception here: each check returns a `Finding`. Code that opens a
driver runs in a child process (`vkbloom._doctor.child`), so that a driver's crash becomes a finding
too.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from typing import Any

from vkbloom._doctor import child, drivers, installation
from vkbloom._doctor.installation import Finding, Report


def examine() -> Report:
    """Examine everything that rendering needs, and make a test render on each adapter.

    Takes some seconds. The test render adds to the pipeline cache, as every render does.
    """
    if core := installation.core():
        return Report((installation.package(), *core, *installation.extras()), False)
    listed = child.ask("adapters", "all", environment=drivers.LOG)
    adapters: list[Mapping[str, Any]] = listed.value["adapters"] if listed.value else []
    chosen = child.ask("render", "auto")
    renders = {} if chosen.value is None else {chosen.value["name"]: chosen}
    for adapter in adapters:
        if adapter["name"] not in renders:
            renders[adapter["name"]] = child.ask("render", adapter["name"])
    loading = [_loader(listed), *drivers.examine(listed.messages)]
    if any(adapter["bundled"] for adapter in adapters):
        # The bundled driver needs neither loader nor manifest.
        loading = [item._replace(status=item.status.replace("problem", "note")) for item in loading]
    findings = [
        installation.package(),
        *installation.memory(),
        *loading,
        *installation.environment(),
        _adapters(listed, loading),
        *installation.gpu_nodes(adapters),
        *([_report_choice(chosen)] if adapters else []),
        *(_test_render(name, answer) for name, answer in renders.items()),
        *installation.caches(),
        *installation.extras(),
    ]
    is_right = [not answer.value["differences"] for answer in renders.values() if answer.value]
    return Report(tuple(findings), any(is_right))


def _loader(listed: child.Answer) -> Finding:
    """Judge the loader by its log, and by why there is no adapter of the system."""
    reason = listed.failure or (listed.value or {}).get("reason", "")
    version = re.search(r"Version (\d+\.\d+\.\d+)", "\n".join(listed.messages))
    if "Vulkan loader" in reason or not (version or listed.value):
        wheel = installation.install_wheel("vkbloom-lavapipe")
        advice = "Install the loader (apt install libvulkan1, or dnf install vulkan-loader), or a "
        advice += f"driver that needs none: {wheel}."
        return Finding("Vulkan loader", "problem", f"not found: {reason}", advice)
    return Finding("Vulkan loader", "ok", f"version {version[1] if version else 'not in its log'}")


def _adapters(listed: child.Answer, loading: Sequence[Finding]) -> Finding:
    """Judge the list of adapters; `loading`: what was found of the loader and of drivers."""
    if listed.value and listed.value["adapters"]:
        return Finding("adapters", "ok", drivers.names(listed.value["adapters"]))
    reason = listed.failure or "no driver has a device with Vulkan 1.3"
    messages = drivers.complaints(listed.messages)
    said = f"; the loader says: {' / '.join(messages)}" if messages else ""
    has_problem = any(finding.status == "problem" for finding in loading)
    is_above = has_problem or installation.memory()
    advice = "Solve the problems above first." if is_above else drivers.INSTALL_DRIVER
    return Finding("adapters", "problem", f"none: {reason}{said}", advice)


def _report_choice(chosen: child.Answer) -> Finding:
    topic, wanted = "chosen adapter", os.environ.get("VKBLOOM_ADAPTER")
    reason = (
        '"auto" prefers discrete, integrated, virtual, cpu, in that order, and any of them to '
        "a driver that is not conformant"
    )
    advice = "Set VKBLOOM_ADAPTER to software, hardware, or a part of another adapter's name."
    if wanted:
        reason = f'VKBLOOM_ADAPTER is {wanted!r} and replaces "auto"'
        advice = "Correct or unset VKBLOOM_ADAPTER."
    if chosen.value is None:
        return Finding(topic, "problem", f"{reason}; it fails: {chosen.failure}", advice)
    return Finding(topic, "ok", f"{chosen.value['summary']}; {reason}")


def _test_render(name: str, answer: child.Answer) -> Finding:
    topic, advice = "test render", "Update its driver, or use another adapter."
    if answer.value is None:
        advice = installation.memory_advice() or advice
        return Finding(topic, "problem", f"{name} fails: {answer.failure}", advice)
    if answer.value["differences"]:
        text = f"{name} renders wrong values: {'; '.join(answer.value['differences'])}"
        return Finding(topic, "problem", text, f"{advice} Do not trust its framebuffers.")
    return Finding(topic, "ok", f"{name} renders the expected values in all framebuffers")
