"""Passes that are given at run time: SPIR-V and the names of what it reads."""

from __future__ import annotations

import gc
import hashlib
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.images import picture
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, _core
from vkbloom._custom.rows import CoreShader, Resource, Row
from vkbloom._settings.blocks import settings_block

compiler = shutil.which("glslangValidator") or shutil.which("glslang")
pytestmark = pytest.mark.skipif(compiler is None, reason="needs glslang")

HEAD = "#version 450\nlayout(location = 0) out vec4 colour;\n"
BLOCK = "layout(set = 0, binding = 0, std140) uniform Values { vec4 tint; } values;\n"
FIRST = "layout(set = 0, binding = 1) uniform sampler2D first;\n"
TINT = (
    HEAD + BLOCK + FIRST + "void main() { colour = values.tint * "
    "textureLod(first, gl_FragCoord.xy / textureSize(first, 0), 0.0); }"
)

IMAGE = picture(32, 20)


class Custom:
    """Settings of a method whose passes are given."""

    def __init__(self, *passes: Row) -> None:
        self.passes = passes

    def _core_block(self) -> bytes:
        return settings_block("custom", {"format": "rgba32float"})

    def core_passes(self, frame: tuple[int, int], buffers: tuple[int, int]) -> Any:
        return tuple(one.pack() for one in self.passes)


@pytest.fixture(scope="module")
def spirv(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return compile_pass(tmp_path_factory.mktemp("spirv"), TINT)


def compile_pass(folder: Path, text: str) -> bytes:
    source, target = folder / "one.frag", folder / "one.spv"
    source.write_text(text)
    assert compiler
    subprocess.run([compiler, "-V", str(source), "-o", str(target)], check=True)
    return target.read_bytes()


def run(renderer: Renderer, settings: Custom) -> tuple[dict[str, Any], dict[str, float]]:
    """Return all framebuffers, and the times of the passes that ran."""
    source = _core.image_source(IMAGE)
    plan = renderer._core.plan(source, settings, None)
    arrays = {name: np.empty(shape, dtype) for name, shape, dtype in plan.outputs}
    times, _ = renderer._core.run(source, (plan,), (tuple(arrays.values()),)).wait()
    return arrays, times[0]


def row(code: bytes) -> Row:
    shader = CoreShader("tint", code, hashlib.sha256(code).digest()[:16])
    return Row("bloom", shader, (32, 20), ("MAIN",), True, struct.pack("4f", 1, 1, 1, 1))


def test_another_shader_runs_its_pass_again_and_an_equal_one_does_not(
    renderer: Renderer, spirv: bytes, tmp_path: Path
) -> None:
    other = compile_pass(tmp_path, TINT.replace("values.tint *", "values.tint + "))
    run(renderer, Custom(row(spirv)))
    before = renderer._core.pipeline_count
    gc.collect()
    assert not run(renderer, Custom(row(spirv)))[1]
    assert renderer._core.pipeline_count == before
    frames, times = run(renderer, Custom(row(other)))
    assert set(times) == {"bloom", "final"}
    assert renderer._core.pipeline_count == before + 1
    np.testing.assert_allclose(frames["bloom"][..., :3], IMAGE[..., :3] + 1, rtol=1e-6)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "passes"))
def test_faulty_pass_is_refused(renderer: Renderer, spirv: bytes, call: str, error: str) -> None:
    def change(**fields: Any) -> None:
        run(renderer, Custom(row(spirv)._replace(**fields)))

    def twice() -> None:
        run(renderer, Custom(row(spirv), row(spirv)))

    assert_refused(call, error, {"change": change, "twice": twice, "Resource": Resource})
