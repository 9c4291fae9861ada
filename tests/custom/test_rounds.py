"""Loops that change their condition in vain end, and say so; those that end are as they were."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from tests.custom.front_ends import (
    Source,
    compile_all,
    has_endless_loop,
    limit_rounds,
    read_schema,
    slang,
)
from tests.custom.test_described import load
from tests.exhaustive import some
from tests.images import picture
from vkbloom import Renderer, load_method

pytestmark = pytest.mark.usefixtures("glslang")

GLSL: Final = """\
#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 result;
layout(binding = 0) uniform sampler2D image;
layout(binding = 1) uniform Values {{ int zero; float none; int few; }};
{}
void main()
{{
    result = texture(image, uv) * float(zero + few) * none;
    {}
}}
"""
#: Bodies of main, and a function before it.
VAIN: Final[Mapping[str, tuple[str, ...]]] = {
    "adds a uniform of 0": ("for (int i = 0; i < 5; i += zero) result.r++;",),
    "adds 0 times it": ("for (int i = 0; i < 5; i += 0 * i) result.r++;",),
    "one as a factor": ("for (int i = 1; i < 5; i *= 1) result.r++;",),
    "keeps the larger": ("for (int i = -1; i < 5; i = max(i, 0)) result.r++;",),
    "floats have no such number": ("for (float x = 0.0; x < 3e7; x += 1.0) result.r++;",),
    "steps over it": ("for (float x = 0.0; x != 3.3; x += 1.1) result.r++;",),
    "too small a step": ("for (float x = 1.0; x < 2.0; x += 1e-9) result.r++;",),
    "a number of the wrong sign": ("for (int i = 0; i < few; i--) result.r += zero;",),
    "a texel": ("float x = 0.0; while (x <= 1.0) x = 1e-6 * texture(image, uv).r;",),
    "checked at its end": ("int i = 0; do { i += zero; } while (i < 5); result.r += i;",),
    "left in the middle": (
        "int i = 0; while (true) { i++; if (i > 5) continue; if (i > 9) break; } result.r += i;",
    ),
    "left by return": ("int i = 0; while (true) { i += zero; if (i > 5) return; }",),
    "in a switch": (
        "int i = 0; while (i < 9) switch (few) { case 0: i++; break; default: i += zero; }",
    ),
    "many rounds": ("for (int i = 0; i < 1000000000; i++) result.r += i ^ few;",),
    "many of a setting": ("for (int i = 0; i < few * 300000000; i++) result.r += i ^ few;",),
    "loops in loops": (
        "for (int i = 0; i < 4000; i++) for (int j = 0; j < 4000; j++)"
        " for (int k = 0; k < 4000; k++) result.r += i ^ j ^ k;",
    ),
    "a function without another end": (
        "result += step(few);",
        "vec4 step(int to) { int i = 0; while (true) { i += zero; if (i > to) return vec4(2); } }",
    ),
    "in a called loop": (
        "for (int i = 0; i < 100; i++) result.r += step(i);",
        "float step(int to) { int i = -1; while (i < to) i += zero; return float(i); }",
    ),
}
#: Loops, and whether they are shown to end after a few rounds, so that they are not counted.
COUNTED: Final = {
    "for (int i = 0; i < 9; i++) result.r++;": True,
    "for (int i = -4; i <= 4; ++i) for (int j = 4; j >= -4; j--) result.r += i * j;": True,
    "for (float x = -3.0; x <= 3.0; x += 0.5) result.r += x;": True,
    "for (uint i = 512u; i > 0u; i >>= 1) result.r += float(i);": True,
    "int i = 0; do { result.r++; } while (++i != 7);": True,
    "int n = 5; for (int i = 0; i < n; i += 2) if (result.r > 4.0) break;": True,
    "for (int i = 0; i < 60; i++) for (int j = 0; j < 60; j++) result.r += i * j;": True,
    "for (int i = 0; i < few; i++) result.r++;": False,
    "for (int i = 0; i < 5000; i++) result.r++;": False,
    "for (int i = 0; i < 9; i++) if (result.r > 1.0) i = zero;": False,
    "for (int i = 0; i < 9 && result.r < 9.0; i++) result.r++;": False,
}
#: Those that end: what they compute must be the same when they are counted.
ENDING: Final = (
    "for (int i = 0; i < few; i++) { if (i == 2) continue; result += texture(image, uv * i); }",
    "for (int i = -4; i <= 4; ++i) for (int j = 4; j >= -4; j--) result.r += float(i * j + i);",
    "int i = 0; do { result.r++; if (result.r > 4.0) break; } while (++i != 7);",
    "float sum = 0.0; int i = 0; while (true) { if (i++ > few) break; if ((i & 1) == 0) continue;"
    " sum += float(i); if (sum > 4.0) { result.g = sum; break; } } result.r = sum;",
    "mat2 m = mat2(1.0); for (int i = 0; i < few; i++) { switch (i) { case 1: m *= 2.0; break;"
    " case 2: continue; default: m[1] += uv; } result.ba = m * uv; } result.rg += m[0];",
)
PASS: Final = """\
[[passes]]
file = "{}"
{}
output = "{}"
textures = {{ image = "glow" }}
values = {{ zero = 0, none = 0, few = 5 }}
"""
LAST: Final = PASS.format("0.frag", "", "out")
#: A vain loop in other languages: file, lines of its pass, text.
OTHERS: Final = {
    "vain.hlsl": (
        'language = "hlsl"\nentry = "Main"',
        "Texture2D image; SamplerState by; cbuffer Values { int zero; float none; int few; };\n"
        "float4 Main(float4 at : SV_Position, float2 uv : TEXCOORD0) : SV_Target\n"
        "{\n    float4 sum = image.Sample(by, uv) * none;\n"
        "    [loop] for (int i = 0; i < few; i += zero) { if (sum.r > 9) continue; sum.r++; }\n"
        "    return sum;\n}\n",
    ),
    "vain.slang": (
        'language = "slang"\nentry = "Main"',
        "uniform Sampler2D image; uniform int zero; uniform float none; uniform int few;\n"
        "uniform RWTexture2D<float4> result;\n"
        '[shader("compute")] [numthreads(8, 8, 1)] void Main(uint3 at : SV_DispatchThreadID)\n'
        "{\n    float4 sum = image[at.xy] * none;\n"
        "    for (int i = 0; i < few; i += zero) sum.r++;\n"
        "    result[at.xy] = sum;\n}\n",
    ),
    "vain.wgsl": (
        'language = "wgsl"\nentry = "paint"',
        "struct Values { zero: i32, none: f32, few: i32 };\n"
        "@group(0) @binding(0) var image: texture_2d<f32>;\n"
        "@group(0) @binding(1) var<uniform> values: Values;\n"
        "@fragment fn paint(@builtin(position) at: vec4f) -> @location(0) vec4f {\n"
        "    var sum = textureLoad(image, vec2i(at.xy), 0) * values.none;\n"
        "    for (var i = 0; i < values.few; i += values.zero) { sum.r += 1.0; }\n"
        "    return sum;\n}\n",
    ),
}


def write(folder: Path, bodies: Iterable[tuple[str, ...]]) -> Path:
    """Write a description with a pass for each body of main; return its path."""
    text = 'bloom = "out"\n'
    for number, (body, *function) in enumerate(bodies):
        (folder / f"{number}.frag").write_text(GLSL.format("".join(function), body))
        text += PASS.format(f"{number}.frag", "", f"image{number}")
    path = folder / "bloom.toml"
    path.write_text(text + LAST)
    return path


def compiled(path: Path) -> list[tuple[int, ...]]:
    """Return the SPIR-V of the shaders of a description."""
    programs, _ = compile_all(read_schema(Source(str(path), path.read_text())), path.parent)
    codes = dict.fromkeys(each.code for each in programs.values())
    return [struct.unpack(f"<{len(code) // 4}I", code) for code in codes]


def rendered(
    renderer: Renderer, path: Path, modules: Iterable[tuple[int, ...]]
) -> dict[str, np.ndarray]:
    """Return the images of a description whose shaders are replaced by modules, each validated."""
    if slang.find_tool("spirv-val") is None:
        pytest.skip("spirv-val is missing")
    for number, words in enumerate(modules):
        path.with_name(f"{number}.spv").write_bytes(struct.pack(f"<{len(words)}I", *words))
    path.write_text(path.read_text().replace(".frag", ".spv"))
    method = load_method(path, name="rounds")
    frames = renderer.apply(picture(8, 6), method(format="rgba32float"))
    return {name: np.array(array) for name, array in frames.items() if name.startswith("image")}


@pytest.fixture(scope="module")
def vain(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[int, ...]]]:
    """Return the path of a description of all vain loops, and their SPIR-V."""
    path = write(tmp_path_factory.mktemp("vain"), VAIN.values())
    return path, compiled(path)


def test_vain_loops_are_limited(vain: tuple[Path, list[tuple[int, ...]]]) -> None:
    for name, words in zip(VAIN, vain[1], strict=True):
        assert not has_endless_loop(words), name
        assert limit_rounds(words) != words, name


def test_vain_loops_end(renderer: Renderer, tmp_path: Path) -> None:
    """With the limit that users have."""
    names = some(VAIN, 3)
    path = write(tmp_path, [VAIN[name] for name in names])
    method = load_method(path, name="rounds")
    frames = renderer.apply(picture(8, 6), method(format="rgba32float"))
    images = [frames[f"image{number}"] for number in range(len(names))]
    if not np.isfinite(images[0]).all():  # else the driver has ended it before
        for name, image in zip(names, images, strict=True):
            assert np.isnan(image).all(), name


def test_what_a_pass_writes_after_the_limit_is_nan(
    renderer: Renderer, vain: tuple[Path, list[tuple[int, ...]]]
) -> None:
    """With a limit before that of any driver."""
    path, modules = vain
    limited = [limit_rounds(words, most=1000) for words in modules]
    for name, image in zip(VAIN, rendered(renderer, path, limited).values(), strict=True):
        assert np.isnan(image).all(), name


def test_loops_that_end_have_equal_bits(renderer: Renderer, tmp_path: Path) -> None:
    """Where all loops are counted, also those that are shown to end; as compiled, and optimized."""
    path = write(tmp_path, ((body,) for body in ENDING))
    modules = compiled(path)
    optimizer = slang.find_tool("spirv-opt")
    if optimizer is not None:
        for words in [*modules]:
            code = struct.pack(f"<{len(words)}I", *words)
            made = slang.optimize(optimizer, code, str(tmp_path))
            modules.append(struct.unpack(f"<{len(made) // 4}I", made))
    more = range(len(ENDING), len(modules))
    passes = [PASS.format(f"{number}.spv", "", f"image{number}") for number in more]
    path.write_text(path.read_text() + "".join(passes))
    plain = rendered(renderer, path, modules)
    counted = [limit_rounds(words, uncounted=0) for words in modules]
    assert all(a != b for a, b in zip(modules[: len(ENDING)], counted, strict=False))
    for (name, image), other in zip(
        plain.items(), rendered(renderer, path, counted).values(), strict=True
    ):
        assert np.array_equal(image, other), name


def test_loops_of_few_rounds_are_left_alone(tmp_path: Path) -> None:
    path = write(tmp_path, ((body,) for body in COUNTED))
    for (body, few), words in zip(COUNTED.items(), compiled(path), strict=True):
        assert (limit_rounds(words) == words) == few, body


@pytest.mark.parametrize("name", OTHERS)
def test_vain_loops_of_other_languages_end(renderer: Renderer, tmp_path: Path, name: str) -> None:
    lines, text = OTHERS[name]
    (tmp_path / name).write_text(text)
    path = tmp_path / "bloom.toml"
    path.write_text('bloom = "out"\n' + PASS.format(name, lines, "out"))
    method = load(path, "rounds")
    (words,) = compiled(path)
    assert limit_rounds(words) != words
    bloom = renderer.apply(picture(8, 6), method(format="rgba32float"))["bloom"]
    # The driver may end it before.
    assert np.isnan(bloom).all() or np.isfinite(bloom).all()


def test_a_vain_loop_of_a_file_of_passes_ends(renderer: Renderer) -> None:
    method = load_method(
        "//!PARAM none\n//!TYPE float\n0\n//!HOOK MAIN\n//!BIND HOOKED\n//!SAVE BLOOM\n"
        "vec4 hook() { vec4 sum = HOOKED_tex(HOOKED_pos);\n"
        "for (float x = 0.0; x < 3.0; x += none) sum.r++; return sum; }\n"
    )
    bloom = renderer.apply(picture(8, 6), method(format="rgba32float"))["bloom"]
    assert np.isnan(bloom).all() or np.isfinite(bloom).all()
