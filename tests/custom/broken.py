"""A description and its shaders, which tests render, and those of broken ones change."""

from __future__ import annotations

from pathlib import Path
from typing import Final

DESCRIPTION: Final = """\
bloom = "out"
defines = { UNUSED = 1 }

[settings.radius]
default = 1.0
range = [0, 4]
text = "how far"

[settings.kind]
choices = ["soft", "hard"]
default = "soft"

[numbers]
half = "radius / 2"

[[passes]]
file = "copy.frag"
down = [0, 2]
output = "down[level]"
size = "size(image) / 2"
format = "rgba16float"
textures = { image = ["down[level - 1]", "glow"] }
values = { gain = "half", more = 0, turn = [3, 4, 5, 6], whole = "kind" }

[[passes]]
name = "two at once"
file = "two.comp"
textures = { image = { source = "down[2]", filter = "nearest", border = "zero" } }
values = { weights = [1, 2, "1 + 2"] }
tile = [4, 4]
[passes.outputs]
whole_image = "whole"
half_image = { image = "half", size = "size(image) / 2", format = "rgba16float" }

[[passes]]
file = "split.frag"
output = "out"
textures = { low = "whole" }
samplers = { point = { filter = "nearest", border = "mirror" } }
constants = { SHARE = 0.25 }
when = "radius > 0"

[[passes]]
file = "split.frag"
output = "out"
textures = { low = "half" }
blend = { source = [1, 1, 1, 0], target = "2 * 2" }
vertex = "full.vert"
"""
SHADERS: Final = {
    "copy.frag": """\
#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
uniform sampler2D image;
uniform Values { float gain; vec4 more[80]; mat2 turn; int whole; };
void main()
{
    result = texture(image, uv) * gain + vec4(more[79].xy, (turn * vec2(1.0, 2.0)))
        + float(whole);
}
""",
    "two.comp": """\
#version 450
layout(local_size_x = 4, local_size_y = 4) in;
layout(binding = 3, rgba16f) uniform writeonly image2D half_image;
layout(binding = 2, rgba16f) uniform writeonly image2D whole_image;
layout(binding = 1) buffer readonly Weights { float weights[]; };
layout(binding = 0) uniform sampler2D image;
void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    imageStore(whole_image, at, weights[1] * texelFetch(image, at, 0));
    imageStore(half_image, at / 2, weights[2] * texelFetch(image, at / 2, 0));
}
""",
    "split.frag": """\
#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
layout(constant_id = 3) const float SHARE = 0.5;
layout(binding = 0) uniform texture2D low;
layout(binding = 1) uniform sampler point;
void main() { result = SHARE * texture(sampler2D(low, point), uv); }
""",
    "full.vert": """\
#version 450
layout(location = 0) out vec2 uv;
void main()
{
    uv = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 2.0;
    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}
""",
}


def write_all(folder: Path) -> Path:
    """Write the description and its shaders; return the path of the description."""
    folder.mkdir(exist_ok=True)
    for name, text in {**SHADERS, "bloom.toml": DESCRIPTION}.items():
        file = folder / name
        if file.is_dir():
            file.rmdir()
        elif file.is_symlink() or file.is_fifo():
            file.unlink()
        file.write_text(text)
    return folder / "bloom.toml"


#: A pass in other languages, with its description.
ONE: Final = """\
bloom = "out"
[[passes]]
file = "{}"
entry = "Main"
output = "out"
textures = {{ Image = "glow" }}
values = {{ gain = 2 }}
"""
OTHERS: Final = {
    "one.hlsl": """\
Texture2D Image : register(t0);
SamplerState Point : register(s0);
cbuffer Values : register(b0) { float gain; };
float4 Main(float4 at : SV_Position, float2 uv : TEXCOORD0) : SV_Target
{
    return gain * Image.Sample(Point, uv);
}
""",
    "one.slang": """\
uniform Sampler2D Image;
uniform float gain;
uniform RWTexture2D<float4> result;
[shader("compute")]
[numthreads(8, 8, 1)]
void Main(uint3 id : SV_DispatchThreadID)
{
    result[id.xy] = gain * Image[id.xy];
}
""",
    "one.shader": """\
Shader "One" {
    HLSLINCLUDE
    sampler2D Image;
    float gain;
    ENDHLSL
    SubShader { Pass { HLSLPROGRAM
        #pragma fragment Main
        float4 Main(float2 uv : TEXCOORD0) : SV_Target { return gain * tex2D(Image, uv); }
    ENDHLSL } }
}
""",
    "one.wgsl": """\
@group(0) @binding(0) var Image: texture_2d<f32>;
@group(0) @binding(1) var Point: sampler;
@group(0) @binding(2) var<uniform> gain: f32;
@fragment
fn Main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return gain * textureSample(Image, Point, uv);
}
""",
    "one.wesl": """\
import package::gains::gain_of;
@group(0) @binding(0) var Image: texture_2d<f32>;
@group(0) @binding(1) var Point: sampler;
@group(0) @binding(2) var<uniform> gain: f32;
@fragment
fn Main(@location(0) uv: vec2f) -> @location(0) vec4f {
    return gain_of(gain) * textureSample(Image, Point, uv);
}
""",
}
#: What the one in WESL imports.
GAINS: Final = "fn gain_of(x: f32) -> f32 { return x; }\n"


def write_one(folder: Path, name: str) -> Path:
    """Write a pass in another language; return the path of its description."""
    (folder / name).write_text(OTHERS[name])
    (folder / "gains.wesl").write_text(GAINS)
    path = folder / "bloom.toml"
    path.write_text(ONE.format(name))
    return path
