"""Modules whose constants are folded before a driver sees them: csrc/spirv/specialize.c."""

from __future__ import annotations

import ctypes
import itertools
import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.core.builds import ROOT, compiler, core_with_faults, require_header
from tests.core.test_spirv import modules
from tests.exhaustive import examples
from tests.processes import output

CONSTANT, STORE = 43, 62
SOURCES = (
    "vulkan/error",
    "vulkan/process",
    "graph/params",
    "spirv/specialize",
    "spirv/module",
    "spirv/instructions",
)
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
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The core's functions, in a library of their own."""
    require_header("vulkan/vulkan_core.h")
    path = tmp_path_factory.mktemp("specialize") / "specialize.so"
    files = [f"csrc/{name}.c" for name in SOURCES]
    options = ["-std=c11", "-O1", "-shared", "-fPIC", "-Icsrc", "-I.", "-DVK_NO_PROTOTYPES"]
    subprocess.run([*compiler(), *options, *files, "-o", str(path), "-lm"], cwd=ROOT, check=True)
    return ctypes.CDLL(str(path))


@pytest.fixture(scope="module")
def specialize(library: ctypes.CDLL) -> Specialize:
    """vkb_specialize."""

    def call(code: bytes, constants: list[int]) -> bytes:
        shader = Shader(b"module", code, len(code))
        out, size = ctypes.c_void_p(), ctypes.c_size_t()
        error = ctypes.create_string_buffer(1 << 14)
        values = (ctypes.c_int32 * 128)(*constants)
        done = library.vkb_specialize(
            ctypes.byref(shader), values, ctypes.byref(out), ctypes.byref(size), error
        )
        if not done & 0xFF:
            raise ValueError(error.raw.replace(b"\0", b"").decode(errors="replace"))
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


def test_folded_modules_are_valid(specialize: Specialize, accepted: Callable[[bytes], str]) -> None:
    random = np.random.default_rng(1)
    for code, _ in modules():
        for _ in range(examples(1)):
            constants = random.choice([0, 1, 2, 3, 4, 8], 40).tolist()
            folded = specialize(code, constants)
            assert accepted(folded) == "", constants
            assert len(folded) < len(code)


#: Conditions on two constants, as GLSL and Python write them.
CONDITIONS = {
    **{f"A {operator} B": f"A {operator} B" for operator in ("==", "!=", "<", "<=", ">", ">=")},
    "A + B > 3": "A + B > 3",
    "A - B < 0": "A - B < 0",
    "A * B == 6": "A * B == 6",
    "7 / (A + 1) == 2": "7 // (A + 1) == 2",
    "7 % (B + 1) == 1": "7 % (B + 1) == 1",
    "-A == ~B": "-A == ~B",
    "(A << B) > 4": "(A << B) > 4",
    "(A >> 1) == 1": "(A >> 1) == 1",
    "uint(A) > 2u": "A > 2",
    "((A & B) | 1) == (A ^ B)": "((A & B) | 1) == (A ^ B)",
    "A == 1 && B == 2 || A > 2": "A == 1 and B == 2 or A > 2",
    "!(A == 1) != (B == 1)": "(A != 1) != (B == 1)",
    "(A > 1 ? A : B) == 2": "(A if A > 1 else B) == 2",
    "A < 0 && values[0] == 1": "False",
    "A >= 0 || values[0] == 1": "True",
    "early(A)": "A > 2 or A == 1",
}
GLSL = """#version 450
layout(constant_id = 0) const int A = 0;
layout(constant_id = 1) const int B = 0;
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Values { int values[]; };
bool early(int x) { if (x > 2) return true; return x == 1; }
void main()
{
    int sum = 0;
    for (int i = 0; i < values[9] && A > 1; ++i) {
        if (B == 1)
            break;
        if (B == 2)
            continue;
        if (values[i] == 5)
            return;
        sum += i;
    }
    do { sum += A; } while (B > 1 && sum < values[8]);
    while (true) {
        if (A == B || sum > 100)
            break;
        sum += 3;
    }
    switch (A) { case 0: sum *= 2; break; case 1: sum *= 3; default: sum += 1; }
    values[999] = sum;
"""


def store(code: bytes) -> list[int]:
    """The constants that a module stores, but for the first that is no constant."""
    words = np.frombuffer(code, np.uint32)
    constants, found, position = {}, [], 5
    while position < len(words):
        opcode, length = int(words[position]) & 0xFFFF, int(words[position]) >> 16
        if opcode == CONSTANT:
            constants[int(words[position + 2])] = int(words[position + 3])
        elif opcode == STORE and int(words[position + 2]) in constants:
            found.append(constants[int(words[position + 2])])
        position += length
    return found


def test_conditions_on_constants_leave_one_way(
    specialize: Specialize, accepted: Callable[[bytes], str], tmp_path: Path
) -> None:
    lines = [
        f"if ({one}) values[{i}] = {1000 + i}; else values[{i}] = {2000 + i};"
        for i, one in enumerate(CONDITIONS)
    ]
    source = tmp_path / "conditions.comp"
    source.write_text(GLSL + "\n".join(lines) + "\n}\n")
    plain, inlined = tmp_path / "plain.spv", tmp_path / "inlined.spv"
    subprocess.run(["glslangValidator", "-V", "--quiet", source, "-o", plain], check=True)
    passes = ["--merge-return", "--inline-entry-points-exhaustive", "--eliminate-dead-functions"]
    passes += ["--eliminate-local-multi-store"]
    subprocess.run(["spirv-opt", *passes, plain, "-o", inlined], check=True)
    for a, b in itertools.product(range(4), range(4)):
        expected = [
            (1000 if eval(one, {"A": a, "B": b}) else 2000) + i
            for i, one in enumerate(CONDITIONS.values())
        ]
        folded = specialize(inlined.read_bytes(), [a, b])
        assert accepted(folded) == "", (a, b)
        assert [one for one in store(folded) if one >= 1000] == expected, (a, b)
        # Whose variables are in memory: the function with two returns stays.
        folded = specialize(plain.read_bytes(), [a, b])
        assert accepted(folded) == "", (a, b)
        assert [one for one in store(folded) if one >= 1000][:-2] == expected[:-1], (a, b)


@pytest.mark.parametrize("operation", [166, 167, 169])
def test_operations_that_lack_operands_are_left(specialize: Specialize, operation: int) -> None:
    """Of a conjunction of one operand, a second one was read."""
    words = [2 << 16 | 20, 1, 3 << 16 | 48, 1, 2, 5 << 16 | 52, 1, 3, operation, 2]
    function = [5 << 16 | 54, 1, 4, 0, 5, 2 << 16 | 248, 6, 1 << 16 | 253, 1 << 16 | 56]
    module = np.array([0x07230203, 0x10300, 0, 8, 0, *words, *function], np.uint32)
    assert operation in np.frombuffer(specialize(module.tobytes(), []), np.uint32)


def test_drivers_fold_to_the_same_bits(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Shaders do not depend on the core's folding: their constants have the same effect."""
    core = core_with_faults(tmp_path_factory.getbasetemp()) / "python"
    said = output("-m", "tests.core.unfolded", cwd=ROOT, PYTHONPATH=str(core))
    result = json.loads(said.splitlines()[-1])
    assert result["compared"] > 30
    assert result["different"] == []
