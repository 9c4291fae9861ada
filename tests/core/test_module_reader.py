"""The reader of modules that come at run time: csrc/spirv/module.c."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.core.builds import ROOT, compiler, require_header
from tests.core.test_spirv import modules
from tests.exhaustive import examples

SOURCES = ("vulkan/error", "vulkan/process", "spirv/module")
Reads = Callable[[bytes], bool]


class Shader(ctypes.Structure):
    """The members of struct vkb_shader that are read."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("code", ctypes.c_char_p),
        ("size", ctypes.c_size_t),
        ("rest", ctypes.c_char * 64),
    ]


@pytest.fixture(scope="module")
def reads(tmp_path_factory: pytest.TempPathFactory) -> Reads:
    """Whether vkb_read_module takes a module."""
    require_header("vulkan/vulkan_core.h")
    path = tmp_path_factory.mktemp("reader") / "reader.so"
    files = [f"csrc/{name}.c" for name in SOURCES]
    options = ["-std=c11", "-O1", "-shared", "-fPIC", "-Icsrc", "-I.", "-DVK_NO_PROTOTYPES"]
    subprocess.run([*compiler(), *options, *files, "-o", str(path), "-lm"], cwd=ROOT, check=True)
    library = ctypes.CDLL(str(path))

    def call(code: bytes) -> bool:
        shader = Shader(b"module", code, len(code))
        module, error = ctypes.create_string_buffer(256), ctypes.create_string_buffer(1 << 14)
        done = library.vkb_read_module(ctypes.byref(shader), module, error)
        assert done & 0xFF or b"module is not SPIR-V" in error.raw
        return bool(done & 0xFF)

    return call


def test_modules_of_the_core_are_read(reads: Reads) -> None:
    assert all(reads(code) for code, _ in modules())


@pytest.mark.parametrize(
    "words",
    [
        [],
        [1 << 16 | 19, 1, 5 << 16 | 54],
        [4 << 16 | 43, 1, 9, 3, 5 << 16 | 54],
        [3 << 16 | 59, 1, 2, 5 << 16 | 54],
        [0, 5 << 16 | 54],
        [9 << 16 | 30, 1],
        [2 << 16 | 19, 1],
    ],
    ids=["empty", "type", "bound", "variable", "length", "end", "functions"],
)
def test_what_is_not_well_formed_is_refused(reads: Reads, words: list[int]) -> None:
    module = np.array([0x07230203, 0x10300, 0, 8, 0, *words], np.uint32)
    assert not reads(module.tobytes())
    assert not reads(b"x" * 64)


def test_changed_modules_are_read_within_their_bounds(tmp_path: Path) -> None:
    """The reader, built with the sanitizers, on modules of the core that are changed at random."""
    program, file = tmp_path / "mutations", tmp_path / "modules"
    files = [f"csrc/{name}.c" for name in SOURCES]
    options = ["-std=c11", "-O1", "-g", "-Icsrc", "-I.", "-DVK_NO_PROTOTYPES"]
    options += ["-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"]
    source = "tests/core/spirv_mutations.c"
    command: list[Any] = [*compiler(), *options, source, *files, "-o", program, "-lm"]
    if subprocess.run(command, cwd=ROOT, check=False, capture_output=True).returncode:
        pytest.skip("the compiler has no sanitizers")
    small = sorted({code for code, _ in modules()}, key=len)[: examples(12)]
    file.write_bytes(b"".join(len(code).to_bytes(4, "little") + code for code in small))
    done = subprocess.run(
        [program, file, "80", "1"], check=False, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    taken, changed = map(int, done.stdout.split())
    assert 0 < taken < changed == 80 * len(small)
