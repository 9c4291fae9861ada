"""What a layer sees that validation does not look at (watched_device.c)."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import build_layer, compiler
from tests.core.test_lesser_devices import SOURCE as LESSER
from tests.core.test_lesser_devices import run
from vkbloom import AdapterInfo

SOURCE = Path(__file__).with_name("watched_device.c")
LAYERS = ("KHRONOS_validation", "VKBLOOM_watched_device", "VKBLOOM_lesser_device")

pytestmark = pytest.mark.skipif(
    "VKBLOOM_SANITIZED" in os.environ, reason="another process, whose core is not sanitized"
)


@pytest.fixture(scope="module")
def layer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the layer, and that of lesser devices; return the folder of the manifests."""
    return build_layer(SOURCE, build_layer(LESSER, tmp_path_factory.mktemp("layer")))


def run_watched(
    layer: Path,
    software: AdapterInfo,
    lesser: str,
    program: tuple[str, ...],
    environment: dict[str, str],
) -> str:
    """Return what a program prints, with both layers below the validation layer."""
    layers = os.pathsep.join(f"VK_LAYER_{name}" for name in LAYERS)
    done = run(layer, software.name, lesser, program, VK_INSTANCE_LAYERS=layers, **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


# Methods at sizes of their own, so that none shares an image; with all framebuffers, then with the
# last alone: of fused passes, and of those that they replace. Then derivatives and scenes.
PROGRAM = """
import os
import sys
import numpy as np
import vkbloom
from tests.exhaustive import EXHAUSTIVE
from vkbloom._doctor.cases import METHODS, presets_of_low_levels

with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True) as renderer:
    every = [*METHODS.values(), *presets_of_low_levels(16).values()]
    for number, settings in enumerate(every if EXHAUSTIVE else every[int(sys.argv[1])::3]):
        dtype = ("uint8", "float16", "float32")[number % 3]
        image = np.ones((18 + number, 26, 3 + number % 2), dtype)
        renderer.apply(image, settings)
        renderer.apply(image, settings.replace(exposure=0.25), framebuffers=("final",))
    for number, settings in enumerate((vkbloom.Separable(), vkbloom.Pyramid(levels=2))):
        image = np.ones((140 + number, 26, 3), np.float32)
        frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
        pullback({"final": np.ones_like(frames["final"])})
    for shading in ("forward", "deferred"):
        renderer.render(vkbloom.Scene.ufo(), None, (210, 40), shading=shading)
"""

#: VK_IMAGE_USAGE_TRANSFER_SRC_BIT: of images with linear texels, since none is without a usage.
NONE = 1
#: What rows need that others have replaced each time, and an image that was uploaded for any plan.
LEFT = {
    "fragment": "",
    "cpu": r"final|scene|image|cotangents_0|down_\d(_across)?",
    "gpu": "image|adjoint_weights",
}


@pytest.mark.parametrize(("turn", "variant"), [*enumerate(LEFT)])
def test_no_image_has_a_usage_that_no_pass_needs(
    layer: Path, tmp_path: Path, software: AdapterInfo, turn: int, variant: str
) -> None:
    """On several GPUs, images that shaders may store to are not compressed."""
    listed = tmp_path / "usages"
    environment = {"VKBLOOM_USAGES": str(listed), "VKBLOOM_VARIANT": variant}
    run_watched(layer, software, "", ("-c", PROGRAM, str(turn)), environment)
    lines = [line.split() for line in listed.read_text().splitlines()]
    needless = {
        (name, usage, used)
        for name, usage, used in lines
        if int(usage, 16) & ~int(used, 16) and int(usage, 16) != NONE
    }
    assert len(lines) > 60
    assert {row for row in needless if not re.fullmatch(LEFT[variant], row[0])} == set()


OLD_LINUX = """
#define _GNU_SOURCE
#include <string.h>
#include <sys/syscall.h>
#include <sys/utsname.h>
#include <unistd.h>
int uname(struct utsname *name)
{
    const long result = syscall(SYS_uname, name);
    strcpy(name->release, "5.11.22-generic");
    return (int)result;
}
"""
LARGE = """
import os
import numpy as np
import vkbloom
with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"]) as renderer:
    renderer.apply(np.ones((600, 500, 4), np.float32))
"""


@pytest.mark.parametrize(("lesser", "linux"), [("cpu", "new"), ("cpu", "old"), ("", "old")])
def test_a_gpu_imports_no_memory_that_a_fork_takes_away(
    layer: Path, tmp_path: Path, software: AdapterInfo, lesser: str, linux: str
) -> None:
    """Before Linux 5.12 a fork leaves pinned pages to the child; a CPU pins none."""
    library, listed = tmp_path / "old.so", tmp_path / "usages"
    command = [*compiler(), "-shared", "-fPIC", "-x", "c", "-", "-o", str(library)]
    subprocess.run(command, input=OLD_LINUX, text=True, check=True)
    listed.touch()
    environment = {"VKBLOOM_USAGES": str(listed)}
    if linux == "old":
        environment["LD_PRELOAD"] = str(library)
    run_watched(layer, software, lesser, ("-c", LARGE), environment)
    assert ("imported" in listed.read_text()) == ((lesser, linux) != ("cpu", "old"))
