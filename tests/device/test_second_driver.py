"""A second software driver, SwiftShader: another compiler, lower limits, looser functions.

`make test-devices` runs all tests with it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tests.core.builds import ROOT
from tests.device.exceptions import EXCEPTIONS
from tests.exhaustive import some
from tests.processes import output
from vkbloom import antialiasing, exposures

#: As Debian's chromium-common installs it.
MANIFEST = Path("/usr/lib/chromium/vk_swiftshader_icd.json")
VARIABLES = {
    **dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(MANIFEST)),
    "VKBLOOM_DRIVER": "system",
    "VKBLOOM_CACHE_DIR": "",
}

pytestmark = [
    pytest.mark.skipif(not MANIFEST.exists(), reason="SwiftShader is not here (chromium-common)"),
    pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="another process, not sanitized"),
]


def test_a_part_of_all_workloads() -> None:
    said = output("-m", "tests.device.second_driver", cwd=ROOT, **VARIABLES)
    result = json.loads(said.splitlines()[-1])
    assert "SwiftShader" in result["adapter"]
    assert result["wrong"] == {}


#: Tests of stages in time, each of a preset.
STAGES = [
    *(f"tests/exposure/test_device.py::test_the_reference[{name}]" for name in exposures),
    *(
        f"tests/taa/test_device.py::test_the_reference_after_20_frames[{name}]"
        for name in antialiasing
    ),
]


def test_stages_in_time() -> None:
    """Exposures and anti-aliasing equal the reference; `make test-devices` runs all tests."""
    chosen = some(STAGES, 5)
    said = output("-m", "pytest", "-q", "-p", "no:cacheprovider", *chosen, cwd=ROOT, **VARIABLES)
    assert f"{len(chosen)} passed" in said


# Prints the processor seconds of the first derivatives, by the image and by the exposure.
DERIVATIVES = """
import time
import numpy as np
import vkbloom
image = np.ones((8, 8, 4), np.float32)
with vkbloom.Renderer("software") as renderer:
    for tonemap in ("reinhard", "aces"):
        settings = vkbloom.Separable(tonemap=tonemap, knee=0.5)
        pullback = vkbloom.vjp(image, settings, renderer=renderer)[1]
        gradients = pullback({"final": image})
        gradients["image"], gradients["exposure"]
print(time.process_time())
"""


def test_derivatives_of_curves_are_compiled_in_seconds() -> None:
    """The driver compiles branches that constants rule out: it took over 300 s for one shader."""
    assert float(output("-c", DERIVATIVES, VKBLOOM_VARIANT="fragment", **VARIABLES)) < 30


# Prints a pixel of half floats without a bloom.
PIXEL = """
import numpy as np
import vkbloom
image = np.array([[[VALUE, 1, 1, 2]]], np.float16)
with vkbloom.Renderer("software") as renderer:
    print(*renderer.apply(image, vkbloom.Separable(bloom=False))["final"][0, 0])
"""
FORKED = """
import os, signal
import numpy as np
import vkbloom
image = np.ones((8, 8, 3), np.float32)
parent = vkbloom.Renderer("software")
parent.apply(image)
child = os.fork()
if child == 0:
    signal.alarm(3)
    vkbloom.Renderer("software").apply(image)
    os._exit(0)
print(os.WIFSIGNALED(os.waitpid(child, 0)[1]))
"""
#: What shows each cause of the exceptions, the variant, and what is printed.
CAUSES = {
    "it stores infinity in half floats as NaN": (
        PIXEL.replace("VALUE", "np.inf"),
        "fragment",
        "nan 1.0 1.0 2.0",
    ),
    "of a NaN in half floats, its rounding changes the next channel": (
        PIXEL.replace("VALUE", "np.nan"),
        "gpu",
        "nan 1.002 1.0 2.0",
    ),
    "a forked child has no threads of the driver: its first frame waits for them or crashes": (
        FORKED,
        "auto",
        "True",
    ),
}


@pytest.mark.parametrize("cause", EXCEPTIONS["swiftshader"])
def test_causes_of_exceptions(cause: str) -> None:
    """A driver without the fault needs no exception."""
    program, variant, printed = CAUSES[cause]
    assert output("-c", program, VKBLOOM_VARIANT=variant, **VARIABLES) == f"{printed}\n"
