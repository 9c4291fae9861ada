"""What runs without the extra `cli`: ``--version``, ``doctor`` and ``adapters``, as plain text."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

from vkbloom._version import installed_version

INSTALL = (
    "install it: pip install 'vkbloom[cli]', or run it without: "
    "uvx 'vkbloom[all]' apply photo.jpg bloom.jpg"
)
_NO_ADAPTER = "vkbloom: no Vulkan adapter was found; run vkbloom doctor for the reason"


def run(words: Sequence[str], missing: Sequence[str]) -> int:
    """Run a command that needs no other package and return its status, or say what to install."""
    first, *options = words or [""]
    form: Literal["text", "json"] = "json" if options == ["--json"] else "text"
    if words in (["--version"], ["-V"]):
        print(f"vkbloom {installed_version()}")
        return 0
    if first == "doctor" and (form == "json" or not options):
        report = examine()
        print(json.dumps(report, indent=2) if form == "json" else "\n".join(lines_of(report)))
        return int(not report["can_render"])
    if first == "adapters" and (form == "json" or not options):
        return list_adapters(form)
    print(f"vkbloom: the command line needs {' and '.join(missing)}; {INSTALL}", file=sys.stderr)
    return 1


def list_adapters(form: Literal["text", "json"]) -> int:
    """Print the adapters, one a line or as JSON, and return the status: 1 if there is none."""
    from vkbloom._renderer import adapter  # noqa: PLC0415  costs start-up time

    found = adapter.adapters()
    if form == "json":
        print(json.dumps([dataclasses.asdict(one) for one in found], indent=2))
    else:
        for one in found:
            print(one.summary)
    if not found:
        print(_NO_ADAPTER, file=sys.stderr)
    return int(not found)


def examine() -> dict[str, Any]:
    """Return the doctor's findings as one object."""
    from vkbloom._doctor import examine  # noqa: PLC0415  costs start-up time

    findings, can_render = examine()
    entries = [finding._asdict() for finding in findings]
    return {"version": installed_version(), "can_render": can_render, "findings": entries}


def lines_of(report: Mapping[str, Any]) -> Iterator[str]:
    """Yield the findings as lines."""
    for finding in report["findings"]:
        yield f"{finding['status']:9}{finding['topic']:30}  {finding['found']}"
        if finding["advice"]:
            yield f"{'':41}-> {finding['advice']}"
    able = "can render" if report["can_render"] else "cannot render"
    problems = sum(finding["status"] == "problem" for finding in report["findings"])
    yield f"\nThis machine {able}. Problems found: {problems}."
