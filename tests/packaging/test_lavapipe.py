"""vkbloom-lavapipe for other programs, with the system's lavapipe in the place of its library."""

from __future__ import annotations

import json
import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT, compiler
from tests.core.test_bundled_driver import library
from tests.processes import output

SOURCE = ROOT / "packaging" / "lavapipe"
# Hides the system's loader from the package, not from the process.
HIDE = "import vkbloom_lavapipe; vkbloom_lavapipe._has_loader = lambda: False\n"
# What programs do that look for the loader by its name: an instance, its layers and its devices.
FIND = """
import ctypes
vulkan = ctypes.CDLL("libvulkan.so.1")
maps = [line for line in open("/proc/self/maps") if "libvulkan.so" in line]
print(maps[0].split(None, 5)[-1].strip())
get = vulkan.vkGetInstanceProcAddr
get.restype = ctypes.c_void_p
get.argtypes = ctypes.c_void_p, ctypes.c_char_p
count = ctypes.c_uint32(9)
pointer = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
pointer(get(None, b"vkEnumerateInstanceLayerProperties"))(ctypes.byref(count), None)
print(count.value)
about = (ctypes.c_uint64 * 8)(1)  # of VkInstanceCreateInfo, which is zero but for its type
instance = ctypes.c_void_p()
assert vulkan.vkCreateInstance(ctypes.byref(about), None, ctypes.byref(instance)) == 0
listed = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
found = listed(get(instance, b"vkEnumeratePhysicalDevices"))
assert found(instance, ctypes.byref(count), None) == 0
print(count.value)
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that has the package, in a folder whose name has a space."""
    folder = tmp_path_factory.mktemp("with a space")
    package = folder / "vkbloom_lavapipe"
    (package / "loader").mkdir(parents=True)
    for file in (SOURCE / "vkbloom_lavapipe").iterdir():
        (package / file.name).write_bytes(file.read_bytes())
    (package / "libvulkan_lvp.so").symlink_to(library())
    (package / "_build.py").write_text("LLVM = MESA = SHA256 = ''\n")
    # As in build.sh.
    options = ["-shared", "-fPIC", "-nostartfiles", "-Wall", "-Wextra", "-Werror"]
    options.append("-Wl,-Bsymbolic,-soname,libvulkan.so.1,-rpath,$ORIGIN/..")
    made = package / "loader" / "libvulkan.so.1"
    files = (SOURCE / "loader.c", package / "libvulkan_lvp.so", "-o", made)
    subprocess.run([*compiler(), *options, *files], check=True)
    return folder


def test_the_systems_loader_reads_the_manifest(site: Path) -> None:
    printed = output("-m", "vkbloom_lavapipe", "--json", PYTHONPATH=str(site))
    variables = json.loads(printed)
    assert variables.keys() == {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"}
    lines = output("-m", "vkbloom_lavapipe", PYTHONPATH=str(site))
    shell = ["bash", "-c", 'set -a; eval "$1"; printenv VK_DRIVER_FILES', "bash", lines]
    read = subprocess.run(shell, capture_output=True, text=True, check=True).stdout.strip()
    assert read == variables["VK_DRIVER_FILES"]
    found = output(
        "-c",
        "import vkbloom; print(*(one.type for one in vkbloom.adapters()))",
        VKBLOOM_DRIVER="system",
        **variables,
    )
    assert found.split() == ["cpu"]


def test_frozen_code_is_of_the_instructions_of_old_cpus(site: Path) -> None:
    words = ("-m", "vkbloom_lavapipe", "--json", "--frozen")
    variables = json.loads(output(*words, PYTHONPATH=str(site)))
    ask = "import vkbloom; print(vkbloom.adapters()[0].name)"
    found = output("-c", ask, VKBLOOM_DRIVER="system", **variables)
    assert re.search(r"llvmpipe .*128 bits", found)
    chosen = "import vkbloom_lavapipe; vkbloom_lavapipe.activate(frozen=True)\n"
    assert output("-c", chosen + ask, VKBLOOM_DRIVER="system", PYTHONPATH=str(site)) == found
    old = "import vkbloom_lavapipe; vkbloom_lavapipe._has_sse4_1 = lambda: False\n"
    old += "try: vkbloom_lavapipe.environment(frozen=True)\nexcept RuntimeError as e: print(e)"
    assert "no SSE4.1" in output("-c", old, PYTHONPATH=str(site))


def test_it_stands_in_for_a_loader(site: Path) -> None:
    found = output("-c", f"{HIDE}vkbloom_lavapipe.activate()\n{FIND}", PYTHONPATH=str(site))
    assert found.splitlines()[0] == str(site / "vkbloom_lavapipe/loader/libvulkan.so.1")
    assert found.splitlines()[1:] == ["0", "1"]
    # Processes that it starts find it by the environment.
    variables = json.loads(
        output(
            "-c",
            f"{HIDE}import json; print(json.dumps(vkbloom_lavapipe.environment()))",
            PYTHONPATH=str(site),
            LD_LIBRARY_PATH="/other",
        )
    )
    assert variables["LD_LIBRARY_PATH"] == f"{site / 'vkbloom_lavapipe/loader'}:/other"
    assert output("-c", FIND, **variables) == found


# What keeps the wheels loadable where glibc is older than where they are built.


# The functions whose newest version is of glibc 2.29, on every machine.
CALLS_OF_LIBM = """\
#include <math.h>
double all(double x) { return exp(x) + exp2(x) + log(x) + log2(x) + pow(x, x); }
"""


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc" or shutil.which("nm") is None, reason="needs glibc and nm"
)
@pytest.mark.parametrize("included", [False, True])
def test_old_versions_of_mathematical_functions(included: bool, tmp_path: Path) -> None:
    (tmp_path / "all.c").write_text(CALLS_OF_LIBM)
    header = ["-include", str(ROOT / "packaging" / "glibc_2_28.h")] if included else []
    command = [*compiler(), *header, "-shared", "-fPIC", "all.c", "-o", "all.so", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    listed = subprocess.run(
        ["nm", "-D", "--undefined-only", tmp_path / "all.so"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = dict(re.findall(r" U (\w+)@GLIBC_([\d.]+)", listed))
    newer = {name for name, version in found.items() if version == "2.29"}
    assert newer == (set() if included else {"exp", "exp2", "log", "log2", "pow"})
    assert {"exp", "exp2", "log", "log2", "pow"} <= set(found)
