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
from numpy.typing import NDArray

from vkbloom import Renderer, _core
from vkbloom._custom.rows import CoreShader, Resource, Row
from vkbloom._settings.blocks import settings_block

compiler = shutil.which("glslangValidator") or shutil.which("glslang")
pytestmark = pytest.mark.skipif(compiler is None, reason="needs glslang")

HEAD = "#version 450\nlayout(location = 0) out vec4 colour;\n"
BLOCK = "layout(set = 0, binding = 0, std140) uniform Values { vec4 tint; } values;\n"
FIRST = "layout(set = 0, binding = 1) uniform sampler2D first;\n"
SECOND = "layout(set = 0, binding = 2) uniform sampler2D second;\n"
TINT = (
    HEAD + BLOCK + FIRST + "void main() { colour = values.tint * "
    "textureLod(first, gl_FragCoord.xy / textureSize(first, 0), 0.0); }"
)
SUM = (
    HEAD + FIRST + SECOND + "void main() { colour = texelFetch(first, ivec2(gl_FragCoord.xy), 0) "
    "+ texelFetch(second, ivec2(gl_FragCoord.xy), 0); }"
)
COMPUTE = (
    "#version 450\nlayout(local_size_x = 8, local_size_y = 4) in;\n"
    + BLOCK
    + FIRST
    + "layout(set = 0, binding = 2) uniform writeonly image2D target;\n"
    "void main() { ivec2 place = ivec2(gl_GlobalInvocationID.xy);\n"
    "if (all(lessThan(place, imageSize(target))))\n"
    "imageStore(target, place, values.tint * texelFetch(first, place, 0)); }"
)

Image = NDArray[np.float32]


class Own:
    """Settings of a method whose passes are given."""

    def __init__(self, *passes: Any, **fields: Any) -> None:
        self.passes: Any = passes
        self.asked: list[Any] = []
        self.fields = {"format": "rgba32float", **fields}

    def _core_block(self) -> bytes:
        return settings_block("custom", self.fields)

    def core_passes(self, frame: tuple[int, int], buffers: tuple[int, int]) -> Any:
        self.asked.append((frame, buffers))
        if not isinstance(self.passes, tuple):
            return self.passes
        return tuple(one.packed() if isinstance(one, Row) else one for one in self.passes)


@pytest.fixture(scope="module")
def spirv(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("spirv")
    return {
        name: compiled(folder, text, stage)
        for name, text, stage in (
            ("tint", TINT, "frag"),
            ("sum", SUM, "frag"),
            ("compute", COMPUTE, "comp"),
        )
    }


def compiled(folder: Path, text: str, stage: str) -> bytes:
    source, target = folder / f"one.{stage}", folder / "one.spv"
    source.write_text(text)
    assert compiler
    subprocess.run([compiler, "-V", str(source), "-o", str(target)], check=True)
    return target.read_bytes()


def shader_of(name: str, code: bytes) -> CoreShader:
    return CoreShader(name, code, hashlib.sha256(code).digest()[:16])


def floats(*values: float) -> bytes:
    return struct.pack(f"{len(values)}f", *values)


def picture(width: int = 32, height: int = 20) -> Image:
    random = np.random.default_rng(5)
    return random.random((height, width, 4), np.float32) * 3


def run(renderer: Renderer, image: Image, settings: Own) -> tuple[dict[str, Any], dict[str, float]]:
    """Return all framebuffers, and the times of the passes that ran."""
    source = _core.image_source(image)
    return finish(renderer, source, settings)


def finish(
    renderer: Renderer, source: _core.Source, settings: Own
) -> tuple[dict[str, Any], dict[str, float]]:
    plan = renderer._core.plan(source, settings, None)
    arrays = {name: np.empty(shape, dtype) for name, shape, dtype in plan.outputs}
    times, _ = renderer._core.run(source, (plan,), (tuple(arrays.values()),)).wait()
    return arrays, times[0]


def tint(spirv: dict[str, bytes], name: str, reads: str, *share: float, **more: Any) -> Row:
    shader = shader_of("tint", spirv["tint"])
    size, shown = more.get("size", (32, 20)), more.get("shown", True)
    return Row(name, shader, size, (reads,), shown, floats(*share))


def test_passes_make_the_bloom(renderer: Renderer, spirv: dict[str, bytes]) -> None:
    image = picture()
    half = tint(spirv, "half", "MAIN", 0.5, 0.5, 0.5, 0.5)
    double = tint(spirv, "double", "GLOW", 2, 2, 2, 2, shown=False)
    summed = shader_of("sum", spirv["sum"])
    both = Row("bloom", summed, (32, 20), ("half", "double"), framebuffer=True)
    settings = Own(half, double, both, threshold=1.5, intensity=0.25)
    frames, _ = run(renderer, image, settings)
    assert settings.asked == [((32, 20), (32, 20))]
    assert list(frames) == ["glow", "half", "bloom", "final"]
    np.testing.assert_allclose(frames["half"], image / 2, rtol=1e-6)
    luminance = image[..., :3] @ np.array([0.2126, 0.7152, 0.0722])
    glow = np.where(luminance[..., None] > 1.5, image[..., :3], 0)
    np.testing.assert_allclose(frames["glow"][..., :3], glow, rtol=1e-6)
    bloom = image[..., :3] / 2 + 2 * glow
    np.testing.assert_allclose(frames["bloom"][..., :3], bloom, rtol=1e-6)
    np.testing.assert_allclose(frames["final"][..., :3], image[..., :3] + bloom / 4, rtol=1e-6)


def test_compute_pass_has_its_own_groups(renderer: Renderer, spirv: dict[str, bytes]) -> None:
    image = picture(33, 19)
    shader = shader_of("compute", spirv["compute"])
    one = Row("bloom", shader, (33, 19), ("MAIN",), True, floats(2, 3, 4, 1), (8, 4))
    frames, _ = run(renderer, image, Own(one))
    np.testing.assert_allclose(frames["bloom"][..., :3], image[..., :3] * (2, 3, 4), rtol=1e-6)


def test_another_shader_runs_its_pass_again_and_an_equal_one_does_not(
    renderer: Renderer, spirv: dict[str, bytes], tmp_path: Path
) -> None:
    image = picture()
    other = compiled(tmp_path, TINT.replace("values.tint *", "values.tint + "), "frag")

    def settings(code: bytes) -> Own:
        shader = shader_of("one", code)
        return Own(Row("bloom", shader, (32, 20), ("MAIN",), True, floats(1, 1, 1, 1)))

    run(renderer, image, settings(spirv["tint"]))
    before = renderer._core.pipeline_count
    gc.collect()
    assert not run(renderer, image, settings(spirv["tint"]))[1]
    assert renderer._core.pipeline_count == before
    frames, times = run(renderer, image, settings(other))
    assert set(times) == {"bloom", "final"}
    assert renderer._core.pipeline_count == before + 1
    np.testing.assert_allclose(frames["bloom"][..., :3], image[..., :3] + 1, rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "glow"}, "two images named glow"),
        ({"name": "other"}, "none writes bloom or main"),
        ({"name": "main", "size": (5, 5)}, "5 x 5, which is not the frame's size, 32 x 20"),
        ({"size": (0, 5)}, "a size of 0 x 5"),
        ({"size": (1 << 20, 5)}, "out of this adapter's range"),
        ({"reads": ("bloom",)}, "bloom reads bloom, which no pass before it writes"),
        ({"reads": ("later",)}, "reads later"),
        ({"reads": ("MAIN",) * 17}, "17 images read are more than 16"),
        ({"params": bytes(1025)}, "1025 bytes of parameters are more than 1024"),
        ({"resources": (Resource(b"", None),)}, "a block of 48 bytes is needed, not of 0"),
        ({"resources": (Resource(bytes(48), None),) * 17}, "17 textures and buffers"),
    ],
)
def test_faulty_pass_is_refused(
    renderer: Renderer, spirv: dict[str, bytes], change: dict[str, Any], message: str
) -> None:
    one = tint(spirv, "bloom", "MAIN", 1, 1, 1, 1)
    with pytest.raises(ValueError, match=message):
        run(renderer, picture(), Own(one._replace(**change)))
