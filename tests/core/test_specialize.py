"""Modules whose constants are folded before a driver sees them, and whose loops are unrolled.

csrc/graph/specialize.c and csrc/graph/unroll.c.
"""

from __future__ import annotations

import ctypes
import itertools
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.core.builds import ROOT, compiler, require_header
from tests.core.test_spirv import modules
from tests.exhaustive import examples

CONSTANT, VARIABLE, STORE, ACCESS_CHAIN, LOOP_MERGE = 43, 59, 62, 65, 246
FUNCTION_STORAGE = 7
SOURCES = (
    "vulkan/error",
    "vulkan/process",
    "graph/params",
    "graph/specialize",
    "graph/unroll",
    "graph/unroll_copy",
    "graph/unroll_values",
    "graph/module",
    "graph/instructions",
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
        values = (ctypes.c_int32 * 64)(*constants)
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
def unroll(library: ctypes.CDLL) -> Callable[[bytes], bytes]:
    """vkb_unroll."""
    library.vkb_alloc.restype = ctypes.c_void_p

    def call(code: bytes) -> bytes:
        error = ctypes.create_string_buffer(1 << 14)
        out = ctypes.c_void_p(library.vkb_alloc(error, len(code), 1))
        size = ctypes.c_size_t(len(code))
        ctypes.memmove(out, code, len(code))
        assert library.vkb_unroll(ctypes.byref(out), ctypes.byref(size), error) & 0xFF
        unrolled = ctypes.string_at(out, size.value)
        library.vkb_free(out)
        return unrolled

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
    specialize: Specialize, unroll: Callable[[bytes], bytes], accepted: Callable[[bytes], str]
) -> None:
    random = np.random.default_rng(1)
    unrolled = 0
    for code, _ in modules():
        for _ in range(examples(1)):
            constants = random.choice([0, 1, 2, 3, 4, 8], 40).tolist()
            folded = specialize(code, constants)
            assert accepted(folded) == "", constants
            assert len(folded) < len(code)
            if (code := unroll(folded)) != folded:
                assert accepted(code) == "", constants
                unrolled += 1
    assert unrolled > 0


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


def stored(code: bytes) -> list[int]:
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
        assert [one for one in stored(folded) if one >= 1000] == expected, (a, b)
        # Whose variables are in memory: the function with two returns stays.
        folded = specialize(plain.read_bytes(), [a, b])
        assert accepted(folded) == "", (a, b)
        assert [one for one in stored(folded) if one >= 1000][:-2] == expected[:-1], (a, b)


def test_what_is_not_spirv_is_refused(specialize: Specialize) -> None:
    for code in (b"", b"x" * 64, next(modules())[0][:-8] + bytes(8)):
        with pytest.raises(ValueError, match="module is not SPIR-V"):
            specialize(code, [])


#: One-word loads, a decoration of an id and a branch to a label beyond the bound, no end.
NOT_WELL_FORMED = (
    [5 << 16 | 54, 1, 2, 0, 3, 1 << 16 | 61],
    [4 << 16 | 71, 900000, 1, 1, 5 << 16 | 54, 1, 2, 0, 3, 2 << 16 | 248, 4, 1 << 16 | 253, 65592],
    [5 << 16 | 54, 1, 2, 0, 3, 2 << 16 | 248, 4, 2 << 16 | 249, 500000, 1 << 16 | 56],
    [5 << 16 | 54, 1, 2, 0, 3, 2 << 16 | 248, 4, 1 << 16 | 253],
    [5 << 16 | 54, 1, 2, 0, 3, 3 << 16 | 247, 4, 0, 1 << 16 | 56],
)


@pytest.mark.parametrize("words", NOT_WELL_FORMED)
def test_what_is_not_well_formed_is_refused(specialize: Specialize, words: list[int]) -> None:
    module = np.array([0x07230203, 0x10300, 0, 8, 0, *words], np.uint32)
    with pytest.raises(ValueError, match="module is not SPIR-V"):
        specialize(module.tobytes(), [])


def test_changed_modules_are_read_within_their_bounds(tmp_path: Path) -> None:
    """All readers, built with the sanitizers, on modules of the core that are changed at random."""
    program, file = tmp_path / "mutations", tmp_path / "modules"
    files = [f"csrc/{name}.c" for name in (*SOURCES, "graph/layers")]
    options = ["-std=c11", "-O1", "-g", "-Icsrc", "-I.", "-Ibuild/spirv", "-DVK_NO_PROTOTYPES"]
    options += ["-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"]
    command: list[Any] = [
        *compiler(),
        *options,
        "tests/core/spirv_mutations.c",
        *files,
        "-o",
        program,
        "-lm",
    ]
    if subprocess.run(command, cwd=ROOT, check=False, capture_output=True).returncode:
        pytest.skip("the compiler has no sanitizers, or the core was not built here")
    small = sorted({code for code, _ in modules()}, key=len)[: examples(12)]
    file.write_bytes(b"".join(len(code).to_bytes(4, "little") + code for code in small))
    done = subprocess.run(
        [program, file, "80", "1"], check=False, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    taken, changed = map(int, done.stdout.split())
    assert 0 < taken < changed == 80 * len(small)


UNROLLED = """#version 450
#extension GL_EXT_control_flow_attributes : require
layout(constant_id = 0) const int A = 0;
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Values { int values[]; };
void main()
{
    int held[8], last = 7;
    for (int i = 0; i < A; ++i) // UNROLL
        held[i] = 1000 * i;
    for (int i = 0; i < A; ++i) { // UNROLL
        for (int j = 0; j < i; ++j) // UNROLL
            if (j % 2 == 1)
                held[i] += j;
        if (values[i] > 0)
            values[i + 10] = held[A - 1 - i] + 1;
        else
            values[i + 10] = held[i] + last;
        last = i;
    }
    BODY
}
"""


def compiled(body: str, folder: Path) -> bytes:
    """A module of UNROLLED, with variables as values."""
    source, plain, inlined = (folder / name for name in ("loops.comp", "plain.spv", "inlined.spv"))
    lines = UNROLLED.replace("BODY", body).splitlines()
    source.write_text(
        "\n".join(f"[[unroll]] {line}" if "// UNROLL" in line else line for line in lines)
    )
    subprocess.run(["glslangValidator", "-V", "--quiet", source, "-o", plain], check=True)
    passes = ["--ssa-rewrite", "--eliminate-dead-code-aggressive", "--merge-blocks"]
    subprocess.run(["spirv-opt", *passes, plain, "-o", inlined], check=True)
    return inlined.read_bytes()


def count(code: bytes, opcode: int, *operands: int) -> int:
    """The instructions with an opcode, and with these last operands if any are given."""
    words = np.frombuffer(code, np.uint32)
    found, position = 0, 5
    while position < len(words):
        length = int(words[position]) >> 16
        last = words[position + length - len(operands) : position + length]
        found += int(words[position]) & 0xFFFF == opcode and (last == operands).all()
        position += length
    return found


def test_loops_are_written_iteration_by_iteration(
    specialize: Specialize,
    unroll: Callable[[bytes], bytes],
    accepted: Callable[[bytes], str],
    tmp_path: Path,
) -> None:
    code = compiled("", tmp_path)
    for a in range(9):
        expected, last = [], 7
        held = [1000 * i + sum(j for j in range(i) if j % 2 == 1) for i in range(a)]
        for i in range(a):
            # What a later iteration adds comes after this one.
            other = held[a - 1 - i] if a - 1 - i <= i else 1000 * (a - 1 - i)
            expected += [other + 1, held[i] + last]
            last = i
        unrolled = unroll(specialize(code, [a]))
        assert accepted(unrolled) == "", a
        assert count(unrolled, LOOP_MERGE) == 0
        assert count(unrolled, VARIABLE, FUNCTION_STORAGE) == 0
        assert stored(unrolled) == expected


#: What comes in a module after loops that could be unrolled.
STAYING = {
    "not asked for": "for (int i = 0; i < A; ++i) values[i] = i;",
    "unknown end": "for (int i = 0; i < values[9]; ++i) // UNROLL\nvalues[i] = i;",
    "break": "for (int i = 0; i < A; ++i) { // UNROLL\nif (values[i] > 3) break; values[i] = 1; }",
    "continue": (
        "for (int i = 0; i < A; ++i) { // UNROLL\nif (values[i] > 3) continue; values[i] = 1; }"
    ),
    "stored under a condition": "if (values[20] > 3) held[1] = 3; values[21] = held[1];",
    "never stored": "int other[4]; other[1] = 3; values[21] = other[2];",
    "unknown place": "values[21] = held[values[20]];",
    "beyond the end": "values[21] = held[A + 6];",
    "the whole array": "int other[8] = held; values[21] = other[1];",
    "another instruction": "atomicAdd(values[21], 1);",
}


@pytest.mark.parametrize("body", STAYING.values(), ids=STAYING)
def test_other_modules_stay(
    body: str, specialize: Specialize, unroll: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    folded = specialize(compiled(body, tmp_path), [3])
    assert unroll(folded) == folded
