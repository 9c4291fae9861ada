"""Shaders for batches: the modules of the core, with layers (csrc/graph/layers.c)."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT, compiler, require_header
from tests.core.test_specialize import SOURCES, Shader
from tests.core.test_spirv import modules
from tests.exhaustive import EXHAUSTIVE

ENTRY_POINT, TYPE_IMAGE, COMPUTE = 15, 25, 5


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """Those files of the core, as a library."""
    require_header("vulkan/vulkan_core.h")
    path = tmp_path_factory.mktemp("layers") / "layers.so"
    files = [f"csrc/{name}.c" for name in (*SOURCES, "graph/layers")]
    options = ["-std=c11", "-shared", "-fPIC", "-Icsrc", "-I.", "-Ibuild/spirv"]
    options.append("-DVK_NO_PROTOTYPES")
    subprocess.run([*compiler(), *options, *files, "-o", str(path), "-lm"], cwd=ROOT, check=True)
    return ctypes.CDLL(str(path))


def with_layers(core: ctypes.CDLL, code: bytes) -> bytes | None:
    """Return the module for images with layers; None if the core refuses it."""
    made, error = Shader(), ctypes.create_string_buffer(1 << 14)
    given = Shader(b"one", code, len(code))
    if not core.vkb_layer_shader(ctypes.byref(given), ctypes.byref(made), error) & 0xFF:
        return None
    address = ctypes.c_void_p.from_buffer(made, Shader.code.offset).value
    assert address
    return ctypes.string_at(address, made.size)


def test_modules_with_layers_are_valid(core: ctypes.CDLL, tmp_path: Path) -> None:
    """All compute shaders that only have images of two dimensions."""
    validator = shutil.which("spirv-val")
    if validator is None:
        pytest.skip("spirv-val is missing (Debian: spirv-tools)")
    files = []
    for number, (code, instructions) in enumerate(modules()):
        by_code = {one[0] & 0xFFFF: one for one in instructions}
        if by_code[ENTRY_POINT][1] != COMPUTE:
            continue
        images = [one for one in instructions if one[0] & 0xFFFF == TYPE_IMAGE]
        # Neither buffers of words nor layers already.
        plain = all(one[3] == 1 and one[5] == 0 for one in images)
        made = with_layers(core, code)
        assert (made is not None) == plain
        if made is not None and images:
            assert made != code
            files.append(tmp_path / f"{number}.spv")
            files[-1].write_bytes(made)
    assert len(files) > 40
    for file in files if EXHAUSTIVE else files[::4]:
        command = [validator, "--target-env", "vulkan1.1", "--scalar-block-layout", str(file)]
        assert subprocess.run(command, capture_output=True, text=True, check=False).stderr == ""
