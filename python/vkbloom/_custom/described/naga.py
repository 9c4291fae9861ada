"""Run in a process of its own: naga, of the package wgpu, makes SPIR-V of WGSL.

The process gets JSON on its standard input, and a Vulkan layer that writes each shader module to a
file, in the folder with the number of its request. The process ends at the first error, which it
prints; else it prints nothing. This file imports nothing of the package.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import sys
from collections.abc import Callable
from typing import Any

#: WGPUShaderRuntimeChecks_BoundsChecks.
BOUNDS_CHECKS = 1
_LOCATION = re.compile(
    r"@location\s*\(\s*(\d+)\s*\)(?:\s*@interpolate\s*\(([^)]*)\))?\s*(?:(\w+)\s*:\s*)?([\w<>]+)"
)


def main() -> None:
    """Compile what the standard input says."""
    import wgpu  # noqa: PLC0415  in this process alone

    # Where this version of wgpu has it.
    with contextlib.suppress(ImportError, AttributeError):
        leave_loops()
    asked = json.loads(sys.stdin.read())
    adapter = wgpu.gpu.request_adapter_sync(power_preference="low-power")
    wanted = [
        name for name in adapter.features if name.startswith(("shader", "float32", "subgroup"))
    ]
    device = adapter.request_device_sync(
        required_features=[
            name for name in wanted if "atomic" not in name and "barycentric" not in name
        ]
        + [name for name in adapter.features if "adapter-specific" in name or "norm" in name]
    )
    modules: dict[str, Any] = {}

    def module_of(code: str) -> Any:
        if code not in modules:
            modules[code] = device.create_shader_module(code=code)
        return modules[code]

    for number, each in enumerate(asked["requests"]):
        # The layer looks for it at each module.
        folder = os.environ["VKBLOOM_MODULES"] = os.path.join(asked["folder"], str(number))
        os.mkdir(folder)
        make_pipeline(device, module_of, each)


def make_pipeline(device: Any, module_of: Callable[[str], Any], asked: dict[str, Any]) -> None:
    """Make a pipeline, so that naga makes the SPIR-V of its shaders."""
    module = module_of(asked["code"])
    constants = asked["constants"]
    stage = {"module": module, "entry_point": asked["entry"], "constants": constants}
    if asked["stage"] == "compute":
        device.create_compute_pipeline(layout="auto", compute=stage)
        return
    inputs, outputs = asked["inputs"], asked["outputs"]
    vertex = {**stage, "entry_point": asked.get("vertex", "main")}
    if asked.get("vertex_code") != asked["code"]:
        code = asked.get("vertex_code") or vertex_text(inputs)
        vertex["module"], vertex["constants"] = module_of(code), {}
    device.create_render_pipeline(
        layout="auto",
        vertex=vertex,
        fragment={**stage, "targets": [{"format": "rgba16float"} for _ in range(outputs)]},
    )


def leave_loops() -> None:
    """Have shaders made without a counter in each loop, which ends it after 2**64 runs.

    It makes loops slower, and hides those that have no way out. Bounds stay checked.
    """
    from wgpu.backends.wgpu_native import _api  # noqa: PLC0415  in this process alone

    calls = _api.libf
    made = getattr(calls, "wgpuDeviceCreateShaderModuleTrusted", None)
    if made is not None:
        calls.wgpuDeviceCreateShaderModule = lambda device, described: made(
            device, described, BOUNDS_CHECKS
        )


def vertex_text(inputs: list[list[str]]) -> str:
    """Return a vertex shader that writes the inputs of a fragment shader."""
    members = "".join(
        f"@location({number}) {f'@interpolate({how}) ' if how else ''}m{number}: {kind}, "
        for number, how, kind in inputs
    )
    return (
        f"struct Made {{ @builtin(position) position: vec4<f32>, {members} }}\n"
        "@vertex fn main() -> Made { var made: Made; return made; }\n"
    )


if __name__ == "__main__":
    try:
        main()
    except Exception as error:
        print(f"VKBLOOM-ERROR\n{error}", flush=True)
        sys.exit(1)
