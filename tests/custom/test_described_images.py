"""Images of shaders with a description: arrays, layers, what a frame before has left, vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.custom.test_described import Array, bloom, require, write
from tests.images import picture
from vkbloom import Renderer, ShaderError, load_method

pytestmark = pytest.mark.usefixtures("glslang")

#: Three levels in one dispatch: the workgroup that is the last to finish makes the third one.
CHAIN = """\
#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2DArray levels[4];
layout(binding = 1, rgba32f) coherent uniform image2DArray second;
layout(binding = 2) coherent buffer Counter { uint done[]; };
layout(push_constant) uniform Constants { uint groups; };
shared uint last;
void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i)
        sum += imageLoad(levels[0], ivec3(2 * at + ivec2(i & 1, i >> 1), 0));
    imageStore(levels[1], ivec3(at, 0), sum / 4.0);
    if (all(equal(at & 1, ivec2(0)))) {
        sum = vec4(0.0);
        for (int i = 0; i < 16; ++i)
            sum += imageLoad(levels[0], ivec3(2 * at + ivec2(i & 3, i >> 2), 0));
        imageStore(second, ivec3(at / 2, 0), sum / 16.0);
    }
    memoryBarrierImage();
    barrier();
    if (gl_LocalInvocationIndex == 0)
        last = atomicAdd(done[0], 1u) + 1u;
    barrier();
    if (last != groups || gl_LocalInvocationIndex >= 8u)
        return;
    ivec2 to = ivec2(gl_LocalInvocationIndex & 3u, gl_LocalInvocationIndex >> 2u);
    sum = vec4(0.0);
    for (int i = 0; i < 4; ++i)
        sum += imageLoad(second, ivec3(2 * to + ivec2(i & 1, i >> 1), 0));
    imageStore(levels[3], ivec3(to, 0), sum / 4.0);
}
"""
CHAIN_PASS = """\
bloom = "mip[1]"
[settings.count]
type = "int"
default = 3
[[passes]]
file = "chain.comp"
[passes.textures]
"levels[0]" = "glow"
[passes.outputs]
levels = { image = "mip[element]", size = "size(glow) // 2 ** element", when = "element <= count" }
second = { image = "mip[2]", size = "size(glow) // 4" }
[passes.values]
groups = 2
done = "zeros(6)"
"""


def load_chain(folder: Path, description: str = CHAIN_PASS) -> type:
    try:
        return load_method(write(folder, description, chain_comp=CHAIN), name="chain")
    except ShaderError as error:
        if "pip install" not in str(error):
            raise
        pytest.skip(str(error))


def test_one_dispatch_writes_all_levels_of_an_array(renderer: Renderer, tmp_path: Path) -> None:
    """With a layer in each coordinate, the first one only read, and a counter of zeros."""
    method = load_chain(tmp_path)
    image = picture(32, 16)
    for _ in range(2):
        frames = renderer.apply(image, method(format="rgba32float"))
        assert list(frames) == ["glow", "mip_3", "mip_2", "bloom", "final"]
        wanted = image[..., :3].astype(np.float64)
        for level in (1, 2, 3):
            height, width = wanted.shape[0] // 2, wanted.shape[1] // 2
            wanted = wanted.reshape(height, 2, width, 2, 3).mean(axis=(1, 3))
            if level > 1:
                assert np.abs(frames[f"mip_{level}"][..., :3] - wanted).max() < 1e-5
    assert "mip_3" not in renderer.apply(image, method(format="rgba32float", count=2))


SAMPLED = """\
#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
layout(binding = 0) uniform sampler2D images[2];
layout(binding = 5) uniform sampler2DArray deep;
uniform Values { int which; };
void main()
{
    vec3 at = vec3(uv * vec2(textureSize(deep, 0).xy), 7.0);
    result = texture(images[which], uv) + texelFetch(deep, ivec3(at), 0)
        + float(textureSize(deep, 0).z) * textureLod(deep, vec3(uv, 1.0), 0.0);
}
"""
SAMPLED_PASS = """\
bloom = "out"
[[passes]]
file = "sampled.frag"
output = "first[1]"
textures = { "images[0]" = "glow", "images[1]" = "black", deep = "black" }
values = { which = 0 }
[[passes]]
file = "sampled.frag"
output = "out"
textures = { images = ["first[element]", "black"], deep = "frame" }
values = { which = 1 }
"""


def test_arrays_and_layers_of_textures(renderer: Renderer, tmp_path: Path) -> None:
    load_chain(tmp_path)
    image = picture(9, 7)
    result = bloom(renderer, write(tmp_path, SAMPLED_PASS, sampled_frag=SAMPLED), image)
    assert np.abs(result[..., :3] - 3 * image[..., :3]).max() < 1e-4


#: As Unity's headers have functions for half beside those for float.
HALVES = """\
Shader "Own" { SubShader { Pass { HLSLPROGRAM
#include_with_pragmas "Twice.hlsl"
#pragma fragment Share
Texture2D Image; SamplerState Linear;
half4 _Shares[2]; half3 _More; float _Last;
half4 Share(float2 uv : TEXCOORD0) : SV_Target
{
    half4 sum = Image.Sample(Linear, uv) * _Shares[1];
    return sum + half4(_More, 0) + _Last + Twice(half(0.1)) + Twice(0.05);
}
ENDHLSL } } }
"""
TWICE = """\
half Twice(half x) { return 2 * x; }
float Twice(float x) { return 2 * x; }
"""
HALVES_PASS = """\
bloom = "out"
[[passes]]
file = "halves.shader"
output = "out"
textures = { Image = "glow" }
values = { _Shares = [9, 9, 9, 9, 0.1, 0.2, 0.3, 0.4], _More = [0.1, 0.2, 0.3], _Last = 0.7 }
"""


def test_half_is_float(renderer: Renderer, tmp_path: Path) -> None:
    """Also where it is a type of its own: with all digits, and in the members of blocks."""
    require("hlsl")
    image = picture(9, 7)
    path = write(tmp_path, HALVES_PASS, halves_shader=HALVES, Twice_hlsl=TWICE)
    result = bloom(renderer, path, image)
    # 0.1 is rounded to 11 bits, since it is half(0.1).
    expected = image[..., :3] * [0.1, 0.2, 0.3] + [0.1, 0.2, 0.3] + 0.7 + 0.3
    assert np.abs(result[..., :3] - expected).max() < 1e-4


ECHO = """\
#version 450
layout(location = 0) out vec4 result;
layout(binding = 0) uniform sampler2D before;
layout(binding = 1) uniform sampler2D now;
uniform Values { vec2 size; };
void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    result = texelFetch(now, 2 * at, 0) + 0.5 * texelFetch(before, at, 0) + vec4(size, 0.0, 0.0);
}
"""
ECHO_PASS = """\
bloom = "bloom"
[[passes]]
file = "echo.frag"
output = "echo[0]"
size = "size(glow) / 2"
textures = { before = "HISTORY_echo[0]", now = "glow" }
values = { size = "size(before)" }
[[passes]]
file = "echo.frag"
output = "bloom"
textures = { before = "echo[0]", now = "black" }
values = { size = 0 }
"""


def test_what_the_frame_before_has_left(renderer: Renderer, tmp_path: Path) -> None:
    method = load_method(write(tmp_path, ECHO_PASS, echo_frag=ECHO), name="echo")
    images = [picture(8, 6, seed=seed) for seed in (1, 2)]
    settings = method(format="rgba32float")
    expected = np.zeros((3, 4, 3))
    for image, frames in zip(images, renderer.map(images, settings), strict=True):
        expected = image[::2, ::2, :3] + 0.5 * expected + [4, 3, 0]
        assert np.abs(frames["echo_0"][..., :3] - expected).max() < 1e-5
    again = renderer.apply(images[0], settings)["echo_0"]
    assert np.abs(again[..., :3] - images[0][::2, ::2, :3] - [4, 3, 0]).max() < 1e-5


QUAD = """\
@group(0) @binding(3) var point: sampler;
@group(0) @binding(1) var image: texture_2d<f32>;
@group(0) @binding(0) var<uniform> width: f32;
struct Corner { @builtin(position) position: vec4f, @location(0) uv: vec2f }
@vertex fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let at = vec2f(f32((index + 2) / 3 % 2), f32(index % 2));
    return Corner(vec4f(width * (at * vec2f(2, -2) + vec2f(-1, 1)), 0, 1), at);
}
@fragment fn colour(given: Corner) -> @location(0) vec4f {
    return textureSample(image, point, given.uv);
}
@fragment fn endless(given: Corner) -> @location(0) vec4f {
    var sum = vec4f();
    loop { sum += textureSampleLevel(image, point, given.uv, width); }
    return sum;
}
"""
QUAD_PASS = """\
bloom = "out"
[[passes]]
file = "quad.wgsl"
entry = "colour"
vertex = "corner"
vertices = 6
output = "out"
textures = { image = "glow" }
samplers = { point = "nearest" }
values = { width = 1 }
"""


@pytest.mark.parametrize("vertex", ["corner", "corner.wgsl"])
def test_vertex_shaders_of_wgsl(renderer: Renderer, tmp_path: Path, vertex: str) -> None:
    """In the same file, or in another one; y runs upwards in WebGPU's clip space."""
    require("wgsl")
    image = picture(9, 7)
    own = QUAD.partition("@fragment")[0].replace("fn corner", "fn colour")
    text = QUAD_PASS.replace('"corner"', f'"{vertex}"')
    path = write(tmp_path, text, quad_wgsl=QUAD, corner_wgsl=own)
    result = bloom(renderer, path, image)
    assert np.abs(result[..., :3] - image[..., :3]).max() < 1e-5
    if vertex != "corner":
        # The kept result is that of the old file. Pixels that it leaves out are black.
        (tmp_path / "corner.wgsl").write_text(own.replace("width * (", "0.5 * width * ("))
        result = bloom(renderer, path, image)
        assert np.abs(result[0, :, :3]).max() == 0 < np.abs(result[3, 4, :3]).max()


OLD = "void mainImage(out vec4 c, vec2 p) { c = texture2D(iChannel0, p / iResolution.xy); }\n"


def test_old_names_of_shadertoy(renderer: Renderer, tmp_path: Path) -> None:
    (tmp_path / "old.frag").write_text(OLD)
    image = picture(9, 7)
    result: Array = bloom(renderer, tmp_path / "old.frag", image)
    assert np.abs(result[..., :3] - image[..., :3]).max() < 1e-5


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


AGAIN = CHAIN_PASS + CHAIN_PASS[CHAIN_PASS.index("[[passes]]") :]
REFUSED: tuple[tuple[str, int, str], ...] = (
    (changed(CHAIN_PASS, '"levels[0]" = "glow"', '"levels[1]" = "glow"'), 6, "does not only read"),
    (changed(CHAIN_PASS, "levels = {", '"levels[1]" = {'), 6, "the shader writes 'levels[3]'"),
    (changed(CHAIN_PASS, "levels = {", "lvls = {"), 6, "the shader writes 'levels[1]'"),
    (changed(CHAIN_PASS, '"element <= count"', '"elem <= count"'), 10, "'elem' is not a number"),
    (changed(CHAIN_PASS, '"mip[2]"', '"mip[element + 1]"'), 11, "in arrays of textures alone"),
    (changed(CHAIN_PASS, "zeros(6)", "zeros(1e9)"), 14, "zeros: 1e+09 is out of range"),
    (changed(CHAIN_PASS, "zeros(6)", "zeros(1, 2)"), 14, "zeros takes a number"),
    (changed(CHAIN_PASS, "file =", "vertices = 6\nfile ="), 6, "no vertex shader of its own"),
    (AGAIN, 21, "the shader reads mip[2], which an earlier pass wrote"),
    (changed(ECHO_PASS, '"HISTORY_echo[0]"', '"HISTORY_ech[0]"'), 6, "is not an image here"),
    (changed(ECHO_PASS, '"HISTORY_echo[0]"', '["HISTORY_echo[0]", "glow"]'), 6, "the only source"),
    (changed(ECHO_PASS, '"HISTORY_echo[0]"', '"HISTORY_echo[1]"'), 6, "echo[1] is not written in"),
    (changed(QUAD_PASS, '"corner"', '"corners"'), 0, "'corners' is not one of the file's: corner"),
    (changed(QUAD_PASS, "vertices = 6", "vertices = 4"), 6, "is not a multiple of 3"),
    (changed(QUAD_PASS, '"colour"', '"endless"'), 3, "a loop that never ends"),
)


@pytest.mark.parametrize(("text", "line", "cause"), REFUSED, ids=range(len(REFUSED)))
def test_what_is_not_possible_is_refused(tmp_path: Path, text: str, line: int, cause: str) -> None:
    """With the line of the description, or of the shader."""
    path = write(tmp_path, text, chain_comp=CHAIN, echo_frag=ECHO, quad_wgsl=QUAD)
    where = f"{path}:{line}: " if line else f"{tmp_path}/quad.wgsl:1: "
    with pytest.raises((ValueError, ShaderError)) as caught:
        load_method(path, name="refused")
    if "pip install" in str(caught.value):
        pytest.skip(str(caught.value))
    assert str(caught.value).startswith(where), str(caught.value)
    assert cause in str(caught.value)
