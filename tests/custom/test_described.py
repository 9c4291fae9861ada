"""Shaders as engines ship them, with a description: one bloom in each language."""

from __future__ import annotations

import importlib.util
import pickle
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import succeed
from tests.custom.broken import SHADERS
from tests.custom.front_ends import find_compiler, identity, run_limited
from tests.images import picture
from vkbloom import Renderer, Settings, ShaderError, load_method, reference, testing

pytestmark = pytest.mark.usefixtures("glslang")

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "languages"
LANGUAGES = ("glsl", "hlsl", "slang", "wgsl", "wesl")

Array = NDArray[Any]


def require(language: str) -> None:
    """Skip the test where the language's compiler is not installed."""
    load(EXAMPLES / language / "bloom.toml", f"in_{language}")


def load(path: Path, name: str) -> Any:
    """Load a method; skip the test where its compiler is not installed."""
    try:
        return load_method(path, name=name)
    except ShaderError as error:
        if "pip install" not in str(error):
            raise
        pytest.skip(str(error))


def write(folder: Path, description: str, **files: str) -> Path:
    """Write a description and its shaders; names have _ in place of the dot."""
    for name, text in files.items():
        (folder / ".".join(name.rsplit("_", 1))).write_text(text)
    path = folder / "bloom.toml"
    path.write_text(description)
    return path


def bloom(renderer: Renderer, path: Path, image: Array, **fields: Any) -> Array:
    settings = load_method(path)(format="rgba32float", **fields)
    result: Array = renderer.apply(image, settings)["bloom"]
    return result


@pytest.mark.parametrize("language", LANGUAGES)
def test_one_bloom_in_each_language(renderer: Renderer, language: str) -> None:
    """It is the preset's, and its reference's."""
    require(language)
    image = picture(70, 54, highest=20)
    method: Any = load_method(EXAMPLES / language / "bloom.toml", name=f"in_{language}")
    settings = method(format="rgba32float", radius=1.25)
    preset = vkbloom.Pyramid(format="rgba32float", levels=settings.count, radius=1.25)
    frames = renderer.apply(image, settings)
    levels = [
        f"{way}_{level}"
        for way, ends in (("down", (0, 5, 1)), ("up", (3, -1, -1)))
        for level in range(*ends)
    ]
    assert list(frames) == ["glow", *levels, "bloom", "final"]
    wanted = renderer.apply(image, preset)
    expected = reference.apply(image, preset)
    # GPUs filter with positions of 8 fractional bits.
    limit = 1e-4 if renderer.info.type == "cpu" else 20 * 2.0**-8
    for name in ("down_4", "up_1", "bloom", "final"):
        assert np.abs(frames[name] - wanted[name])[..., :3].max() < limit, name
        assert np.abs(frames[name] - expected[name])[..., :3].max() < limit, name


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_half_texel_fault_is_found_in_each_language(
    renderer: Renderer, tmp_path: Path, language: str
) -> None:
    require(language)
    shutil.copytree(EXAMPLES / language, tmp_path, dirs_exist_ok=True)
    changed = 0
    for file in tmp_path.iterdir():
        text = file.read_text()
        if file.suffix == ".toml":
            continue
        for right, faulty in (
            ("uv + vec2(x, y) * texel", "uv + (vec2(x, y) + 0.5) * texel"),
            ("uv + float2(x, y) * Texel", "uv + (float2(x, y) + 0.5) * Texel"),
            ("uv + vec2f(x, y) * levels.texel", "uv + (vec2f(x, y) + 0.5) * levels.texel"),
            ("corner = float2(i % 2, i / 2) * 2 - 1", "corner = float2(i % 2, i / 2) * 2 - 0.5"),
        ):
            changed += text.count(right)
            text = text.replace(right, faulty)
        file.write_text(text)
    assert changed == 1
    method: Any = load_method(tmp_path / "bloom.toml", name="faulty")
    settings = method(format="rgba32float", count=2)

    def apply(image: Array) -> Array:
        result: Array = renderer.apply(np.asarray(image, np.float32), settings)["bloom"]
        return result

    report = testing.report(apply, size=(32, 32))
    held = {row.name: row.held for row in report.rows}
    assert not held["symmetric"]
    assert not held["centroid_kept"]
    assert held["gain"]


TWICE = "void mainImage(out vec4 c, vec2 p) { c = 2.0 * texture(iChannel0, p / iResolution.xy); }\n"


def test_shadertoy(renderer: Renderer, tmp_path: Path) -> None:
    """A file with mainImage needs no description."""
    path = tmp_path / "toy.frag"
    path.write_text(TWICE)
    image = picture(20, 12)
    assert np.abs(bloom(renderer, path, image)[..., :3] - 2 * image[..., :3]).max() < 1e-5


COPY = SHADERS["copy.frag"]
COPY_PASS = """\
bloom = "out"
[[passes]]
file = "copy.frag"
output = "out"
textures = { image = "glow" }
[passes.values]
gain = "1 / 2"
more = 0
"more[79]" = [1, 2, 0, 0]
turn = [3, 4, 5, 6]
whole = -1
"""


def test_numbers_of_a_large_block(renderer: Renderer, tmp_path: Path) -> None:
    """A block that is larger than the parameters, with an array, a matrix and an int."""
    path = write(tmp_path, COPY_PASS, copy_frag=COPY)
    image = picture(9, 7)
    result = bloom(renderer, path, image)
    expected = image[..., :3] / 2 + np.array([1, 2, 3 + 2 * 5]) - 1
    assert np.abs(result[..., :3] - expected).max() < 1e-5


TWO = SHADERS["two.comp"]
TWO_PASS = """\
bloom = "whole"
[[passes]]
file = "two.comp"
textures = { image = { source = "glow", filter = "nearest", border = "zero" } }
values = { weights = [1, 2, "1 + 2"] }
[passes.outputs]
whole_image = "whole"
half_image = { image = "half", size = "size(glow) / 2", format = "rgba16float" }
"""


def test_a_compute_shader_writes_two_images(renderer: Renderer, tmp_path: Path) -> None:
    path = write(tmp_path, TWO_PASS, two_comp=TWO)
    image = picture(14, 10)
    frames = renderer.apply(image, load_method(path)(format="rgba32float"))
    assert list(frames) == ["glow", "bloom", "half", "final"]
    assert np.abs(frames["bloom"][..., :3] - 2 * image[..., :3]).max() < 1e-5
    assert frames["half"].dtype == np.float16
    assert np.abs(frames["half"][..., :3] - 3 * image[:5, :7, :3]).max() < 4e-3


TARGETS = """\
#version 450
layout(location = 0) out vec4 first;
layout(location = 1) out vec4 second;
layout(constant_id = 7) const float SHARE = 0.5;
uniform sampler2D image;
void main()
{
    first = vec4(SHARE);
    second = texture(image, gl_FragCoord.xy / vec2(textureSize(image, 0)) + 1.0);
}
"""
TARGETS_PASS = """\
bloom = "out"
[[passes]]
file = "targets.frag"
textures = { image = { source = "frame", border = "repeat" } }
constants = { SHARE = 0.25 }
outputs = { 0 = "out", 1 = "other" }
[[passes]]
file = "targets.frag"
textures = { image = "other" }
outputs = { 0 = { image = "out" }, second = "last" }
blend = { source = [1, 1, 1, 0], target = "2 * 2" }
"""


def test_two_targets_borders_constants_and_blending(renderer: Renderer, tmp_path: Path) -> None:
    path = write(tmp_path, TARGETS_PASS, targets_frag=TARGETS)
    image = picture(8, 6)
    frames = renderer.apply(image, load_method(path)(format="rgba32float"))
    assert np.abs(frames["bloom"] - [1.5, 1.5, 1.5, 1.0]).max() < 1e-6
    assert np.abs(frames["other"][..., :3] - image[..., :3]).max() < 1e-5
    # Beyond the edge: the last texel.
    assert np.abs(frames["last"] - frames["other"][-1, -1]).max() < 1e-6


def test_a_picture_replaces_the_scene(renderer: Renderer, tmp_path: Path) -> None:
    path = write(tmp_path, COPY_PASS.replace("bloom =", "picture ="), copy_frag=COPY)
    image = picture(9, 7)
    frames = renderer.apply(image, load_method(path)(format="rgba32float"))
    expected = image[..., :3] / 2 + np.array([1, 2, 3 + 2 * 5]) - 1
    assert np.abs(frames["final"][..., :3] - expected).max() < 1e-5
    assert np.abs(frames["bloom"][..., :3] - (expected - image[..., :3])).max() < 1e-5


def test_spirv_is_taken_as_it_is(renderer: Renderer, tmp_path: Path) -> None:
    """That of another description's pass, which names nothing: bound by group and binding."""
    kind: Any = load_method(write(tmp_path, COPY_PASS, copy_frag=COPY), name="of_glsl")
    ((_, program),) = kind.file.source.programs
    (tmp_path / "copy.spv").write_bytes(program.code)
    path = write(tmp_path, COPY_PASS.replace("copy.frag", "copy.spv"))
    image = picture(9, 7)
    method = load(path, "of_spirv")
    first, second = (
        renderer.apply(image, each(format="rgba32float"))["bloom"] for each in (kind, method)
    )
    np.testing.assert_array_equal(first, second)


def test_an_entry_point_in_an_included_file(renderer: Renderer, tmp_path: Path) -> None:
    """As engines have variants of a shader: a file that defines something and includes another."""
    require("hlsl")
    inner = """
    Texture2D Image : register(t0);
    RWTexture2D<float4> Made : register(u0);
    [numthreads(8, 8, 1)]
    void main(uint3 at : SV_DispatchThreadID) { Made[at.xy] = GAIN * Image[at.xy]; }
    """
    outer = '#define GAIN 2.0\n#include "inner.hlsl"\n'
    description = """
    bloom = "out"
    [[passes]]
    file = "outer.hlsl"
    output = "out"
    textures = { t0 = "glow" }
    """
    path = write(tmp_path, description, outer_hlsl=outer, inner_hlsl=inner)
    image = picture(9, 7)
    result = bloom(renderer, path, image)
    assert np.abs(result[..., :3] - 2 * image[..., :3]).max() < 1e-5


def test_a_vertex_shader_of_its_own(renderer: Renderer, tmp_path: Path) -> None:
    """In HLSL, where clip space has y up and textures begin at the top."""
    require("hlsl")
    text = """
    Texture2D Image; SamplerState Point;
    struct Varyings { float4 position : SV_Position; float2 uv : TEXCOORD0; };
    Varyings Vertex(uint id : SV_VertexID)
    {
        Varyings made;
        made.uv = float2(id & 1, id >> 1) * 2;
        made.position = float4(made.uv * float2(2, -2) + float2(-1, 1), 0, 1);
        return made;
    }
    float4 Fragment(Varyings i) : SV_Target { return Image.Sample(Point, i.uv); }
    """
    description = """
    bloom = "out"
    [[passes]]
    file = "own.hlsl"
    entry = "Fragment"
    vertex = "Vertex"
    output = "out"
    textures = { Image = "glow" }
    samplers = { Point = "nearest" }
    """
    image = picture(9, 7)
    result = bloom(renderer, write(tmp_path, description, own_hlsl=text), image)
    assert np.abs(result[..., :3] - image[..., :3]).max() < 1e-5


@pytest.mark.parametrize(("number", "gain"), [(0, 1), (1, 3)])
def test_programs_of_a_shaderlab_file(
    renderer: Renderer, tmp_path: Path, number: int, gain: float
) -> None:
    """The first one shares what names its entry point."""
    require("hlsl")
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "Shared.hlsl").write_text("#define GAIN 3.0\n")
    text = """Shader "Own" {
    // A SubShader has its HLSLPROGRAM, which CGPROGRAM was before.
    HLSLINCLUDE
    #pragma fragment First
    #include "lib/Shared.hlsl"
    sampler2D _MainTex;
    ENDHLSL
    SubShader {
        Pass { HLSLPROGRAM
            #pragma vertex Vert
            float4 First(float2 uv : TEXCOORD0) : SV_Target { return tex2D(_MainTex, uv); }
        ENDHLSL }
        Pass { HLSLPROGRAM
            #pragma fragment Second
            float4 Second(float2 uv : TEXCOORD0) : SV_Target { return GAIN * tex2D(_MainTex, uv); }
        ENDHLSL }
    } }
    """
    description = f"""
    bloom = "out"
    [[passes]]
    file = "own.shader"
    program = {number}
    output = "out"
    textures = {{ _MainTex = "glow" }}
    """
    image = picture(9, 7)
    result = bloom(renderer, write(tmp_path, description, own_shader=text), image)
    assert np.abs(result[..., :3] - gain * image[..., :3]).max() < 1e-5


KERNELS = """\
#pragma kernel Twice  MAIN=Twice GAIN=2  // its name, and its gain
#pragma kernel Thrice MAIN=Thrice GAIN=3
Texture2D_float Image;
RWTexture2D<float4> Made;
[numthreads(8, 8, 1)]
void MAIN(uint3 at : SV_DispatchThreadID) { Made[at.xy] = GAIN * Image[at.xy]; }
"""
KERNEL_PASS = """
bloom = "out"
[[passes]]
file = "own.compute"
entry = "Thrice"
output = "out"
textures = { Image = "glow" }
"""


def test_kernels_of_a_compute_shader_of_unity(renderer: Renderer, tmp_path: Path) -> None:
    """Each has definitions of its own."""
    require("hlsl")
    image = picture(9, 7)
    result = bloom(renderer, write(tmp_path, KERNEL_PASS, own_compute=KERNELS), image)
    assert np.abs(result[..., :3] - 3 * image[..., :3]).max() < 1e-5
    path = write(tmp_path, KERNEL_PASS.replace('entry = "Thrice"', ""))
    with pytest.raises(ShaderError, match="entry: give one of the file's kernels: Twice, Thrice"):
        load_method(path, name="broken")
    assert 'entry = "Twice"' in succeed("describe", tmp_path / "own.compute").stdout


def test_attributes_of_wgsl_in_any_order(renderer: Renderer, tmp_path: Path) -> None:
    require("wgsl")
    text = """
    @binding(0) @group(0) var image: texture_2d<f32>;
    @group(0) @binding(1) var made: texture_storage_2d<rgba32float, write>;
    @compute @workgroup_size(8, 8)
    fn main(@builtin(global_invocation_id) at: vec3u) {
        textureStore(made, at.xy, 2 * textureLoad(image, at.xy, 0));
    }
    """
    description = """
    bloom = "out"
    [[passes]]
    file = "own.wgsl"
    output = "out"
    textures = { image = "glow" }
    """
    image = picture(9, 7)
    result = bloom(renderer, write(tmp_path, description, own_wgsl=text), image)
    assert np.abs(result[..., :3] - 2 * image[..., :3]).max() < 1e-5


def test_a_package_of_wesl(renderer: Renderer, tmp_path: Path) -> None:
    """Its root is above the file; definitions are constants, and replace words before that."""
    require("wesl")
    (tmp_path / "package" / "effects").mkdir(parents=True)
    gains = """
    import constants::GAIN;
    const gain = GAIN;
    @group(0) @binding(0) var source_image: texture_2d<f32>;
    """
    (tmp_path / "package" / "gains.wesl").write_text(gains)
    text = """
    import package::gains::{gain, source_image};
    @group(0) @binding(1) var made: texture_storage_2d<##FORMAT##, write>;
    @compute @workgroup_size(8, 8)
    fn main(@builtin(global_invocation_id) at: vec3u) {
        textureStore(made, at.xy, gain * textureLoad(source_image, at.xy, 0));
    }
    """
    (tmp_path / "package" / "effects" / "own.wesl").write_text(text)
    description = """
    bloom = "out"
    [[passes]]
    file = "package/effects/own.wesl"
    dependencies = { package = "package" }
    defines = { FORMAT = "rgba32float", GAIN = "2.0" }
    output = "out"
    textures = { source_image = "glow" }
    """
    image = picture(9, 7)
    result = bloom(renderer, write(tmp_path, description), image)
    assert np.abs(result[..., :3] - 2 * image[..., :3]).max() < 1e-5


def test_a_class_travels_without_compilers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pickle has the compiled shaders."""
    kind: Any = load_method(write(tmp_path, COPY_PASS, copy_frag=COPY), name="travels")
    data = pickle.dumps(kind(intensity=0.5))
    # Another class takes its place.
    load_method("//!HOOK MAIN\nvec4 hook() { return vec4(1); }\n", name="travels")
    (tmp_path / "copy.frag").unlink()
    loaded: Settings = pickle.loads(data)
    assert loaded.intensity == 0.5
    assert loaded.to_dict()["sha256"] == kind.file.source.digest


def test_a_description_is_written_from_reflection(tmp_path: Path) -> None:
    for name in ("down.frag", "up.frag"):
        shutil.copy(EXAMPLES / "glsl" / name, tmp_path)
    path = tmp_path / "bloom.toml"
    files = [tmp_path / "down.frag", tmp_path / "up.frag"]
    path.write_text(succeed("describe", *files).stdout)
    kind = load_method(path, name="described")
    assert {"levels", "radius", "gain", "share"} <= {*kind().to_dict()}


def test_names_in_a_description_that_is_written(tmp_path: Path) -> None:
    """Members of two blocks, a setting that all methods have, the first of two images."""
    text = """\
    #version 450
    layout(local_size_x = 8, local_size_y = 8) in;
    uniform sampler2D image;
    layout(binding = 1) uniform First { float exposure; } first;
    layout(binding = 2) uniform Second { float exposure; } second;
    layout(binding = 3) writeonly uniform image2D one;
    layout(binding = 4) writeonly uniform image2D two;
    void main()
    {
        ivec2 at = ivec2(gl_GlobalInvocationID);
        imageStore(one, at, first.exposure * texelFetch(image, at, 0));
        imageStore(two, at, vec4(second.exposure));
    }
    """
    (tmp_path / "own.comp").write_text(text)
    path = tmp_path / "bloom.toml"
    path.write_text(succeed("describe", tmp_path / "own.comp").stdout)
    kind = load_method(path, name="written")
    assert "exposure_value" in kind().to_dict()


@pytest.mark.parametrize("language", ["hlsl", "slang", "wgsl", "wesl"])
def test_errors_of_compilers_name_file_and_line(tmp_path: Path, language: str) -> None:
    require(language)
    shutil.copytree(EXAMPLES / language, tmp_path, dirs_exist_ok=True)
    file = tmp_path / f"bloom.{language}"
    lines = file.read_text().split("\n")
    line = next(number for number, text in enumerate(lines, 1) if "16.0" in text)
    lines[line - 1] = lines[line - 1].replace("sum", "sun")
    file.write_text("\n".join(lines))
    with pytest.raises(ShaderError, match=f"^{file}:{line}: .*sun") as caught:
        load_method(tmp_path / "bloom.toml", name="broken")
    assert str(caught.value).count("\n") == 1


def test_one_process_compiles_all_of_wgsl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each process takes longer to start than all entry points take."""
    require("wgsl")
    started = []

    def run(*given: Any, **limits: Any) -> tuple[int, str]:
        started.append(given)
        return run_limited(*given, **limits)

    shutil.copytree(EXAMPLES / "wgsl", tmp_path, dirs_exist_ok=True)
    text = (tmp_path / "bloom.wgsl").read_text()
    path = tmp_path / "bloom.toml"
    before, entry, after = path.read_text().partition('file = "bloom.wgsl"\nentry = "up"')
    path.write_text(before + entry.replace("bloom", "another") + after)
    (tmp_path / "another.wgsl").write_text(text)
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", "")
    monkeypatch.setattr("vkbloom._custom.described.wgsl.run_limited", run)
    load_method(path, name="together")
    assert len(started) == 1
    # Its second request is the one that fails.
    (tmp_path / "another.wgsl").write_text(text.replace("16.0", "sun"))
    with pytest.raises(ShaderError, match=r"another\.wgsl:\d+: .*sun"):
        load_method(path, name="together")


LACKING = {
    "glsl": "pip install vkbloom[shaders]",
    "hlsl": "pip install vkbloom[slang] && pip install --no-deps slangtorch",
    "slang": "pip install vkbloom[slang] && pip install --no-deps slangtorch",
    "wgsl": "pip install vkbloom[wgsl]",
    "wesl": "pip install vkbloom[wgsl]",
    "spirv": "pip install vkbloom[slang]",
}


@pytest.mark.parametrize("language", LACKING)
def test_a_missing_compiler_is_named_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, language: str
) -> None:
    def missing(*_: Any) -> None:
        return None

    folder = "vkbloom._custom.described.slang"
    monkeypatch.setattr(f"{folder}.find_tool", missing)
    monkeypatch.setattr(f"{folder}.shutil.which", missing)
    monkeypatch.setattr(importlib.util, "find_spec", missing)
    monkeypatch.setitem(sys.modules, "vkbloom_glslang", None)
    for variable in ("VKBLOOM_SLANGC", "VKBLOOM_WESL_PYTHON"):
        monkeypatch.delenv(variable, raising=False)
    name = "copy.spv" if language == "spirv" else f"copy.{language}"
    path = write(tmp_path, COPY_PASS.replace("copy.frag", name))
    (tmp_path / name).write_text("// nothing\n")
    # A process looks for it once.
    known = (find_compiler, identity)
    for each in known:
        each.cache_clear()
    try:
        with pytest.raises(ShaderError, match=re.escape(LACKING[language])) as caught:
            load_method(path, name="broken")
    finally:
        for each in known:
            each.cache_clear()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("language", "variable"), [("hlsl", "VKBLOOM_SLANGC"), ("wesl", "VKBLOOM_WESL_PYTHON")]
)
def test_a_program_of_the_environment_that_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, language: str, variable: str
) -> None:
    monkeypatch.setenv(variable, str(tmp_path / "none"))
    path = write(tmp_path, COPY_PASS.replace("copy.frag", f"copy.{language}"))
    (tmp_path / f"copy.{language}").write_text("// nothing\n")
    with pytest.raises(ShaderError, match=rf"^{variable}: '.*none' is not a program$"):
        load_method(path, name="broken")
