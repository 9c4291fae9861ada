"""Compare this device with `vkbloom.reference` in about 200 cases: ``vkbloom doctor --self-test``.

They run in a child process, so that a driver's crash is reported with the case in which it came.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any, Final

from vkbloom._doctor.cases import Case, cases
from vkbloom._doctor.child import SAFE_PATH
from vkbloom._doctor.deviations import Deviation
from vkbloom._errors import Error
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._version import installed_version

PROGRAM = ("-m", "vkbloom._doctor.self_test")
_MARK: Final = "vkbloom-case "


def run(adapter: str, only: str = "") -> Iterator[dict[str, Any]]:
    """Yield a report of the device, then one of each case; `only`: a part of the cases' names."""
    command = [sys.executable, SAFE_PATH, *PROGRAM, adapter, only]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, errors="replace"
    ) as child:
        running = {"group": "device", "name": adapter}
        assert child.stdout is not None
        for line in child.stdout:
            if line.startswith(_MARK):
                result = json.loads(line.removeprefix(_MARK))
                running = result.pop("next", running)
                if result:
                    yield result
    if child.returncode:
        wrong = f"the process ended with status {child.returncode}; its errors are printed above"
        yield running | {"wrong": wrong}


def report(adapter: str, result: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """Return what `run` yielded as one object, to be written as JSON."""
    device: dict[str, Any] = next((item for item in result if "device" in item), {"device": None})
    done = [item for item in result if "device" not in item]
    groups = []
    for name in dict.fromkeys(item["group"] for item in done):
        group = [item for item in done if item["group"] == name]
        worst = max(group, key=lambda item: item.get("share", 0.0))
        groups.append(
            {
                "name": name,
                "cases": len(group),
                "wrong": sum(bool(item["wrong"]) for item in group),
                "largest_error": worst.get("off"),
                "allowed": worst.get("allowed"),
                "worst": worst["name"],
                "seconds": sum(item.get("seconds", 0.0) for item in group),
            }
        )
    wrong = [
        {key: item[key] for key in ("group", "name", "wrong")} for item in done if item["wrong"]
    ]
    return {
        "self_test": 1,
        "version": installed_version(),
        "platform": platform.platform(),
        "adapter": adapter,
        "device": device["device"],
        "passed": bool(done) and not wrong,
        "cases": len(done),
        "seconds": seconds,
        "groups": groups,
        "wrong": wrong,
    }


class _Renderers(contextlib.ExitStack):
    """An open renderer of each set of variants; adapters that lack one have none."""

    def __init__(self, adapter: str) -> None:
        super().__init__()
        self.adapter = adapter
        self.opened: dict[str, Renderer] = {}

    def get(self, variant: str) -> Renderer:
        if variant not in self.opened:
            if variant != "auto":
                os.environ["VKBLOOM_VARIANT"] = variant
            self.opened[variant] = self.enter_context(open_renderer(self.adapter))
        return self.opened[variant]


def judge(case: Case, renderer: Renderer) -> dict[str, Any]:
    """Run a case; return its error of the largest share of what is allowed, and its time."""
    start = time.perf_counter()
    worst = Deviation("", 0.0, 0.0)
    try:
        for each in case.check(renderer):
            worst = max(worst, each, key=lambda item: item.share)
            if each.wrong:
                # The first one in the order of the data flow: later ones follow from it.
                worst = each
                break
    except Exception as error:
        # Of the driver, or of what the driver made vkbloom do.
        worst = Deviation("", 0.0, 0.0, f"{type(error).__name__}: {error}")
    return {
        "group": case.group,
        "name": case.name,
        "off": worst.off if worst.off == worst.off else None,
        "allowed": worst.allowed,
        "share": min(worst.share, 1e9),
        "wrong": worst.wrong,
        "seconds": time.perf_counter() - start,
    }


def _tell(**result: Any) -> None:
    # A driver may have printed without a line's end.
    print(f"\n{_MARK}{json.dumps(result)}", flush=True)


def main() -> None:
    """Run the cases on the adapter that the command line names."""
    adapter, only = sys.argv[1:]
    chosen = [case for case in cases() if only in f"{case.group}: {case.name}"]
    with _Renderers(adapter) as renderers:
        try:
            info = renderers.get("auto").info
        except (Error, ValueError, OSError) as error:
            _tell(group="device", name=adapter, wrong=f"{type(error).__name__}: {error}")
            return
        _tell(device=dataclasses.asdict(info), count=len(chosen))
        for case in chosen:
            _tell(next={"group": case.group, "name": case.name})
            _tell(**judge(case, renderers.get(case.variant)))


if __name__ == "__main__":
    main()
