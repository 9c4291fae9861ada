"""The usages that images have: those that passes need, and no others.

A layer lists each image with its usages and with what was done to it (watched_device.c). On several
GPUs, colours are not compressed in images with the usage that stores to them.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.core.builds import ROOT, build_layer, layer_variables
from tests.processes import python
from vkbloom import AdapterInfo

SOURCE = Path(__file__).with_name("watched_device.c")

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

#: VK_IMAGE_USAGE_TRANSFER_SRC_BIT: of images as words, since none is without a usage.
NONE = 1
#: What rows need that others have replaced each time, and an image that was uploaded for any plan.
LEFT = {
    "fragment": "",
    "cpu": r"final|scene|down_\d(_across)?",
    "gpu": "image|adjoint_weights",
}


@pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="another process, not sanitized")
@pytest.mark.parametrize(("turn", "variant"), [*enumerate(LEFT)])
def test_no_image_has_a_usage_that_no_pass_needs(
    tmp_path: Path, software: AdapterInfo, turn: int, variant: str
) -> None:
    build_layer(SOURCE, tmp_path)
    listed = tmp_path / "usages"
    done = python(
        *("-c", PROGRAM, str(turn)),
        cwd=ROOT,
        **layer_variables(tmp_path, "VK_LAYER_VKBLOOM_watched_device"),
        VKBLOOM_USAGES=str(listed),
        VKBLOOM_TEST_NAME=software.name,
        VKBLOOM_CACHE_DIR="",
        VKBLOOM_VARIANT=variant,
    )
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in listed.read_text().splitlines()]
    needless = {
        (name, usage, used)
        for name, usage, used in lines
        if int(usage, 16) & ~int(used, 16) and int(usage, 16) != NONE
    }
    assert len(lines) > 60
    assert {row for row in needless if not re.fullmatch(LEFT[variant], row[0])} == set()
