"""Where the core cannot be loaded, laws and the reference work, and a renderer says why not."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from tools.core_tables import FILE, tables

import vkbloom
from tests.core.builds import ROOT
from tests.processes import output, python

# Each makes `from vkbloom import _core` an ImportError, as on a system that has no core.
WITHOUT = "import sys\nsys.modules['vkbloom._core'] = None\n"
WORK = """
import numpy as np, vkbloom
image = np.random.default_rng(0).random((24, 32, 3)).astype("f")

def bloom(image):
    blurred = image.astype(float)
    for axis in (0, 1):
        blurred = sum(np.roll(blurred, k, axis) * w for k, w in ((-1, 0.25), (0, 0.5), (1, 0.25)))
    return blurred

held = {row.name: row.held for row in vkbloom.testing.report(bloom, size=(32, 32)).rows}
print(held["superposition"], held["separable"], held["bounded_fireflies"])
print(*vkbloom.reference.apply(image, vkbloom.presets["jimenez2014"]))
print(vkbloom.testing.diagnose(image, 1.5 * image).cause)
"""


def test_laws_and_the_reference_need_no_core() -> None:
    lines = output("-c", WITHOUT + WORK).splitlines()
    assert lines[0] == "True True False"
    assert lines[1].split()[0] == "glow"
    assert lines[1].split()[-1] == "final"
    assert lines[2] == "gain"


@pytest.mark.parametrize(
    "call",
    [
        "vkbloom.Renderer()",
        "vkbloom.apply(image)",
        "vkbloom.render(vkbloom.Scene.ufo())",
        "vkbloom.vjp(image)",
        "vkbloom.deglare(image, vkbloom.psf.gaussian(sigma=1))",
    ],
)
def test_what_needs_a_device_says_why_there_is_none(call: str) -> None:
    start = "import numpy as np, vkbloom\nimage = np.zeros((8, 8, 3), 'f')\n"
    done = python("-c", f"{WITHOUT}{start}{call}")
    assert "AdapterNotFoundError: vkbloom's core cannot be loaded: import of" in done.stderr
    assert done.returncode == 1


def test_there_are_no_adapters_and_the_doctor_says_why(tmp_path: Path) -> None:
    assert output("-c", f"{WITHOUT}import vkbloom; print(vkbloom.adapters())") == "()\n"
    # For the processes that the doctor starts, too.
    (tmp_path / "sitecustomize.py").write_text(WITHOUT)
    done = python("-m", "vkbloom", "doctor", "--json", PYTHONPATH=str(tmp_path))
    found = json.loads(done.stdout)
    (core,) = (one for one in found["findings"] if one["topic"] == "core")
    assert (done.returncode, found["can_render"], core["status"]) == (1, False, "problem")
    assert "cannot be loaded" in core["found"]
    assert "Vulkan loader" not in {one["topic"] for one in found["findings"]}


def test_the_tables_are_those_of_the_core() -> None:
    assert FILE.read_text() == tables(), "run: python -m tools.core_tables"


def test_errors_have_the_classes_and_attributes_of_the_core() -> None:
    names = ["Error", "AdapterNotFoundError", "DeviceLostError", "OutOfMemoryError"]
    names += ["ValidationError", "ShaderError"]
    show = (
        f"import vkbloom\nfor name in {names}:\n one = getattr(vkbloom, name)\n"
        " print(one.__module__, [base.__name__ for base in one.__mro__], one('x').vk_call)\n"
    )
    assert output("-c", WITHOUT + show) == output("-c", show)


def test_the_types_and_functions_of_the_core_are_there() -> None:
    names = [name for name in dir(vkbloom._core) if not name.startswith("_")]
    show = f"import vkbloom\nfor n in {names}: print(n, callable(getattr(vkbloom._core, n)))\n"
    show += f"for n in {names}: print(n, isinstance(getattr(vkbloom._core, n), type))"
    assert output("-c", WITHOUT + show) == output("-c", show)


def test_the_pure_wheel_has_no_core(tmp_path: Path) -> None:
    command = f"setup.py -q egg_info --egg-base {tmp_path} build --build-base {tmp_path}/build"
    environment = {**os.environ, "VKBLOOM_PURE": "1"}
    words = [sys.executable, *command.split(), "bdist_wheel", "--dist-dir", str(tmp_path)]
    subprocess.run(words, cwd=ROOT, env=environment, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name == f"vkbloom-{vkbloom.__version__}-py3-none-any.whl"
    with zipfile.ZipFile(wheel) as files:
        names = files.namelist()
    assert not [name for name in names if name.endswith((".so", ".pyd"))]
    assert "vkbloom/_core_tables.json" in names
