"""Modules whose constants are folded before a driver sees them (csrc/graph/specialize.c)."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable

import numpy as np
import pytest

from tests.core.builds import ROOT, compiler, require_header
from tests.core.test_spirv import modules

SOURCES = ("vulkan/error", "vulkan/process", "graph/params", "graph/specialize")
Specialize = Callable[[bytes, list[int]], bytes]


class Shader(ctypes.Structure):
    """The members of struct vkb_shader that are read."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("code", ctypes.c_char_p),
        ("size", ctypes.c_size_t),
        ("rest", ctypes.c_char * 64),
    ]


@pytest.fixture(scope="module")
def specialize(tmp_path_factory: pytest.TempPathFactory) -> Specialize:
    """The core's function, in a library of its own."""
    require_header("vulkan/vulkan_core.h")
    path = tmp_path_factory.mktemp("specialize") / "specialize.so"
    files = [f"csrc/{name}.c" for name in SOURCES]
    options = ["-std=c11", "-O1", "-shared", "-fPIC", "-Icsrc", "-I.", "-DVK_NO_PROTOTYPES"]
    subprocess.run([*compiler(), *options, *files, "-o", str(path), "-lm"], cwd=ROOT, check=True)
    library = ctypes.CDLL(str(path))

    def call(code: bytes, constants: list[int]) -> bytes:
        shader = Shader(b"module", code, len(code))
        out, size = ctypes.c_void_p(), ctypes.c_size_t()
        error = ctypes.create_string_buffer(1 << 14)
        values = (ctypes.c_int32 * 64)(*constants)
        done = library.vkb_specialize(
            ctypes.byref(shader), values, ctypes.byref(out), ctypes.byref(size), error
        )
        assert done & 0xFF, error.raw
        folded = ctypes.string_at(out, size.value)
        library.vkb_free(out)
        return folded

    return call


@pytest.fixture(scope="module")
def accepted(tmp_path_factory: pytest.TempPathFactory) -> Callable[[bytes], str]:
    """What spirv-val says of a module: "" if it is valid."""
    validator = shutil.which("spirv-val")
    if validator is None:
        pytest.skip("spirv-val is missing (Debian: spirv-tools)")
    file = tmp_path_factory.mktemp("accepted") / "module.spv"

    def validate(code: bytes) -> str:
        file.write_bytes(code)
        command = [validator, "--target-env", "vulkan1.1", "--scalar-block-layout", str(file)]
        return subprocess.run(command, capture_output=True, text=True, check=False).stderr

    return validate


def test_folded_modules_are_valid(
    specialize: Specialize, accepted: Callable[[bytes], str]
) -> None:
    random = np.random.default_rng(1)
    for code, _ in modules():
        for _ in range(10):
            constants = random.choice([0, 1, 2, 3, 4, 8], 40).tolist()
            folded = specialize(code, constants)
            assert accepted(folded) == "", constants
            assert len(folded) < len(code)
