"""AMD's compiler without its hardware: every method, format and derivative on families of GPUs.

``python -m tests.device.amd_families`` (make test-devices) takes families of RADV, of the Mesa that
is installed and of Debian's backports. null_device.c fakes memory and commands, so that modules,
pipelines, formats and limits are RADV's. Prints failures, spilled registers and shared memory;
``--json FILE`` also writes them.
"""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np

import vkbloom
from tests.core.builds import ROOT, build_layer, layer_variables
from tests.images import DTYPES
from tests.methods.cases import METHODS, presets_of_low_levels
from vkbloom import Renderer, Scene
from vkbloom._settings.settings import BloomFormat

FAMILIES = ("tahiti", "polaris10", "stoney", "vega10", "navi10", "navi21", "gfx1100")
#: As Mesa 25 calls them.
NEWER_NAMES = {"gfx1100": "navi31"}
SOURCE = Path(__file__).with_name("null_device.c")
INSTALLED = Path("/usr/share/vulkan/icd.d/radeon_icd.x86_64.json")
#: Bytes of shared memory of a workgroup: with more, a compute unit of 64 KiB runs one at a time.
MAX_SHARED = 1 << 15

#: A method whose workgroup needs 64 KiB of shared memory.
PLANTED = """
//!HOOK MAIN
//!BIND GLOW
//!SAVE BLOOM
//!COMPUTE 16 16
shared vec4 kept[4096];
void hook() {
    for (uint i = gl_LocalInvocationIndex; i < 4096u; i += 256u)
        kept[i] = GLOW_texOff(vec2(i));
    barrier();
    imageStore(out_image, ivec2(gl_GlobalInvocationID),
               kept[(gl_GlobalInvocationID.x * 77u + gl_LocalInvocationIndex) % 4096u]);
}
"""


def requests(renderer: Renderer, words: list[str]) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Name each request, and what makes it. `words`: "few" of them, and one "planted"."""
    settings = METHODS | presets_of_low_levels(64) | {"photo": vkbloom.presets["photo"]}
    formats = (None, *get_args(BloomFormat))
    number = 0
    for name, method in settings.items():
        for format in formats:
            number += 1
            if "few" in words and number % 17:
                continue
            changed = method.replace(format=format)
            dtype, size = DTYPES[number % 3], ((96, 135), (720, 1280))[number // 3 % 2]
            image = np.ones((*size, 3 + number % 2), dtype)
            for framebuffers in ("all", "final"):
                yield (
                    f"{name} {format} {dtype} {size} {framebuffers}",
                    lambda: renderer.apply(image, changed, framebuffers=framebuffers),  # noqa: B023
                )
        if "few" not in words or number % 4 == 0:
            image = np.ones((40, 50, 3), np.float32)
            yield f"derivatives of {name}", lambda: derivatives(renderer, image, method)  # noqa: B023
    for shading in ("forward", "deferred"):
        yield shading, lambda: renderer.render(Scene.ufo(), None, (64, 36), shading=shading)  # noqa: B023
    if "planted" in words:
        planted = vkbloom.load_method(PLANTED, name="planted")()
        yield "planted", lambda: renderer.apply(np.ones((40, 50, 3), np.float32), planted)


def derivatives(renderer: Renderer, image: Any, settings: vkbloom.Settings) -> None:
    _, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    dict(pullback({"final": np.ones_like(image)}).items())


def record(words: list[str]) -> None:
    """Make the requests on the only adapter; print the failures as JSON."""
    wrong: dict[str, str] = {}
    count = 0
    # Pipelines are created in threads together, which would mix the lines of their figures.
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if "short" in words:  # of address space, for lavapipe's threads alone
        resource.setrlimit(resource.RLIMIT_AS, (5_000_000 << 10,) * 2)
    with Renderer("hardware", validation="validated" in words) as renderer:
        for name, call in requests(renderer, words):
            count += 1
            try:
                call()
            except Exception as error:
                wrong[name] = f"{type(error).__name__}: {error}"
        print(json.dumps({"adapter": renderer.info.summary, "count": count, "wrong": wrong}))


def try_family(family: str, manifest: Path, layers: Path, *words: str, **environment: str) -> Any:
    """Return what `record` prints of a family, with the figures of its shaders."""
    variables = {
        **layer_variables(layers, "VK_LAYER_VKBLOOM_null_device"),
        **dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(manifest)),
        "RADV_FORCE_FAMILY": family,
        "RADV_DEBUG": "shaderstats,nocache",
        "VKBLOOM_DRIVER": "system",
        "VKBLOOM_CACHE_DIR": "",
        **environment,
    }
    done = subprocess.run(
        [sys.executable, "-m", "tests.device.amd_families", "record", *words],
        env={**os.environ, **variables},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        return {"wrong": {"process": f"status {done.returncode}: {done.stderr[-2000:]}"}}
    found = json.loads(done.stdout.splitlines()[-1])
    for name, words_of in (
        ("vgprs_spilled", "Spilled VGPRs"),
        ("sgprs_spilled", "Spilled SGPRs"),
        ("shared", "LDS size"),
        ("vgprs", "VGPRs"),
    ):
        values = re.findall(rf"^{words_of}: (\d+)", done.stderr, re.MULTILINE)
        found[name] = max(map(int, values), default=0)
    found["shaders"] = done.stderr.count("SHADER STATS")
    if found["shared"] > MAX_SHARED:
        found["wrong"]["shared memory"] = f"{found['shared']} bytes, {MAX_SHARED} allowed"
    return found


def main() -> int:
    """Try all families with each Mesa; return the exit status."""
    if sys.argv[1:2] == ["record"]:
        record(sys.argv[2:])
        return 0
    unpacked = subprocess.run(
        [ROOT / "tools" / "mesa_backports.sh", ROOT / "build" / "mesa_backports"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.splitlines()
    backports = dict(line.split("=", 1) for line in unpacked)
    mesas: list[tuple[Path, dict[str, str]]] = [
        (INSTALLED, {}),
        (Path(backports["radeon"]), {"LD_LIBRARY_PATH": backports["LD_LIBRARY_PATH"]}),
    ]
    every = []
    with tempfile.TemporaryDirectory() as folder:
        layers = build_layer(SOURCE, Path(folder))
        for manifest, environment in mesas:
            for family in FAMILIES:
                name = NEWER_NAMES.get(family, family) if environment else family
                found = try_family(name, manifest, layers, "validated", **environment)
                print(*(f"{key}: {value}" for key, value in found.items()), sep=", ", flush=True)
                every.append(found)
    if sys.argv[1:2] == ["--json"]:
        text = json.dumps({"version": vkbloom.__version__, "families": every}, indent=2)
        Path(sys.argv[2]).write_text(f"{text}\n", encoding="utf-8")
    return int(any(found["wrong"] for found in every))


if __name__ == "__main__":
    sys.exit(main())
