"""Custom methods are rendered as libplacebo renders them, by the renderer of all other methods."""

from __future__ import annotations

import json
import pickle
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.custom import COUNTER
from tests.explorer.pages import describe
from tests.images import picture
from tests.processes import output
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Settings, load_method, reference

pytestmark = pytest.mark.usefixtures("glslang")

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "custom_methods"
COPY = "//!HOOK MAIN\n//!BIND HOOKED\nvec4 hook() { return HOOKED_texOff(0); }\n"

Array = NDArray[Any]


def custom(text: str, name: str = "tried", **fields: Any) -> Settings:
    return load_method(text, name=name)(**{"format": "rgba32float", **fields})


def difference(got: Array, want: Array) -> float:
    return float(np.abs(got.astype(np.float64) - want).max())


def test_frames_that_libplacebo_drew(renderer: Renderer, shared_data: Path) -> None:
    folder = shared_data / "hooks"
    inputs, outputs = np.load(folder / "inputs.npz"), np.load(folder / "outputs.npz")
    for case in json.loads((folder / "index.json").read_text())["renders"]:
        (file,) = case["hooks"]
        settings = load_method(folder / file)(format="rgba32float", **case["params"])
        frames = renderer.map([inputs[case["input"]]] * case["frames"], settings)
        got = list(frames)[-1]["final"].astype(np.float64)
        want = outputs[case["key"]].astype(np.float64)
        error = np.abs(got - want)
        assert (error <= case["atol"] + case["rtol"] * np.abs(want)).all(), case["key"]
        assert error.mean() <= case["mean_atol"] + case["rtol"] * np.abs(want).mean(), case["key"]


@pytest.mark.parametrize("name", ["forty_lines", "karis", "streak", "compute"])
@pytest.mark.parametrize("size", [(40, 24), (33, 17)])
def test_the_examples_and_their_references(
    renderer: Renderer, name: str, size: tuple[int, int]
) -> None:
    function = runpy.run_path(str(EXAMPLES / "references.py"))[name]
    settings = load_method(EXAMPLES / f"{name}.hook", reference=function)(format="rgba32float")
    image = picture(*size, highest=2)
    expected = reference.apply(image, settings)
    frames = renderer.apply(image, settings)
    assert set(expected) | {"glow"} == set(frames)
    # GPUs filter with positions of 8 fractional bits: half a step along each axis, of values to 2.
    limit = 2e-4 if renderer.info.type == "cpu" else 2 * 2.0**-8
    for framebuffer, array in expected.items():
        assert difference(frames[framebuffer], array) < limit, framebuffer


def test_a_file_without_bloom_makes_the_picture(renderer: Renderer) -> None:
    image = picture(24, 16, highest=2)
    settings = custom(COPY.replace("return", "return 2.0 *"))
    frames = renderer.apply(image, settings)
    assert difference(frames["final"], 2 * image) < 1e-5
    assert difference(frames["bloom"][..., :3], image[..., :3]) < 1e-5


def test_saved_textures_are_framebuffers_and_a_param_runs_only_its_passes(
    renderer: Renderer,
) -> None:
    settings = load_method(EXAMPLES / "forty_lines.hook")()
    image = picture(64, 48, highest=2)
    assert list(renderer.apply(image, settings)) == ["glow", "half", "rows", "bloom", "final"]
    again = renderer.apply(image, settings.replace(spread=3.5))
    assert list(again.timings) == ["rows", "bloom_buffer", "bloom", "final"]
    again = renderer.apply(image, settings.replace(spread=3.5, exposure=1.0))
    assert list(again.timings) == ["final"]


RESOURCES = """\
//!TEXTURE line
//!SIZE 4
//!FORMAT r8
//!FILTER LINEAR
//!BORDER REPEAT
ff 00 00 00
//!TEXTURE cube
//!SIZE 2 1 2
//!FORMAT rg16u
0100 0200 0300 0400  0500 0600 0700 0800
//!TEXTURE kept
//!SIZE 8 8
//!FORMAT r32f
//!STORAGE

//!BUFFER numbers
//!VAR vec3 a
//!VAR float b
//!VAR float c[2]
0000803f 00000040 00004040 00008040 0000a040 000000000000000000000000
0000c040 000000000000000000000000
//!BUFFER counts
//!VAR uint n
//!STORAGE

//!HOOK MAIN
//!BIND counts
//!BIND kept
//!COMPUTE 8 8
//!WIDTH 8
//!HEIGHT 8
//!SAVE NOTHING
void hook() {
    ivec2 at = ivec2(gl_GlobalInvocationID);
    if (at == ivec2(0)) n += 2u;
    imageStore(kept, at, imageLoad(kept, at) + 0.5);
    imageStore(out_image, at, vec4(0.0));
}
//!HOOK MAIN
//!BIND HOOKED
//!BIND line
//!BIND cube
//!BIND kept
//!BIND numbers
//!BIND counts
vec4 hook() {
    uvec4 texel = texelFetch(cube, ivec3(1, 0, 1), 0);
    return vec4(float(n) + texture(line, 1.125).r, imageLoad(kept, ivec2(3)).r,
                a.z + b + c[1], float(texel.r * 10u + texel.g) + float(frame) / 100.0);
}
"""


def test_textures_buffers_and_their_state(renderer: Renderer) -> None:
    settings = custom(RESOURCES)
    image = picture(24, 16, highest=2)
    frames = [one["final"][2, 3] for one in renderer.map([image] * 3, settings)]
    for place, values in enumerate(frames):
        count = place + 1
        expected = [2 * count + 1, 0.5 * count, 13, 78 + 0.02 * count]
        np.testing.assert_allclose(values, expected, rtol=1e-6)
    # Each call begins anew, also with the same image.
    for _ in range(2):
        assert renderer.apply(image, settings)["final"][2, 3, 0] == 3


def make_textured(count: int) -> str:
    """Return a file of passes that read so many textures."""
    blocks = [f"//!TEXTURE t{i}\n//!SIZE 1\n//!FORMAT r8\nff" for i in range(count)]
    for first in range(0, count, 11):
        names = [f"t{i}" for i in range(first, min(first + 11, count))]
        total = " + ".join(f"texture({name}, 0.5).r" for name in names)
        binds = "".join(f"//!BIND {name}\n" for name in names)
        save = "//!SAVE BLOOM\n" if names[-1] == f"t{count - 1}" else f"//!SAVE S{first}\n"
        blocks.append(f"//!HOOK MAIN\n{binds}{save}vec4 hook() {{ return vec4({total}); }}")
    return "\n".join(blocks) + "\n"


def test_the_state_of_a_sequence_outlives_any_number_of_other_methods(renderer: Renderer) -> None:
    counter, other = custom(COUNTER, "counter"), custom(make_textured(33), "textured")
    image = picture(8, 8)
    counts = []
    # Some frames are rendered ahead.
    for frames in renderer.map([image] * 8, counter):
        counts.append(frames["bloom"][0, 0, 0])
        for number in range(70 if len(counts) in (2, 4) else 0):
            renderer.apply(image, other.replace(exposure=number / 64))
            renderer.apply(image, counter)
    assert counts == [1, 2, 3, 4, 5, 6, 7, 8]


def test_the_random_number_repeats_and_differs_between_passes(renderer: Renderer) -> None:
    text = "//!HOOK MAIN\n//!SAVE A\nvec4 hook() { return vec4(random); }\n"
    settings = custom(
        text + text.replace("SAVE A", "BIND A").replace("random", "random, A_texOff(0).r, 0, 1")
    )
    image = picture(24, 16)
    values = [renderer.apply(image, settings)["final"][0, 0, :2] for _ in range(2)]
    assert (values[0] == values[1]).all()
    assert values[0][0] != values[0][1]
    assert (values[0] >= 0).all()
    assert (values[0] < 1).all()
    other = renderer.apply(image, settings.replace(dither_seed=5))["final"][0, 0, :2]
    assert (other != values[0]).all()


SAVED = COPY.replace("BIND HOOKED", "BIND HOOKED\n//!SAVE A\n//!WHEN HOOKED.w 100 >")
UNSAVED = SAVED + "//!HOOK MAIN\n//!BIND A\nvec4 hook() { return A_texOff(0); }\n"
KEPT = """\
//!HOOK MAIN
//!BIND HISTORY_{0}
//!SAVE {0}
vec4 hook() {{ return HISTORY_{0}_texOff(0); }}
"""
PARAMETERS = """\
//!PARAM mode
//!TYPE ENUM int
soft
hard
//!PARAM gain
//!TYPE float
//!MINIMUM 0
1
"""


@pytest.mark.parametrize(("call", "error"), rows(__file__, "images and values"))
def test_a_wrong_value_is_refused(renderer: Renderer, call: str, error: str) -> None:
    def apply(text: str) -> vkbloom.Frames:
        return renderer.apply(picture(24, 16), custom(text))

    parametrized = load_method(PARAMETERS + COPY, name="tried")
    names = {
        "apply": apply,
        "headed": lambda line: apply(COPY.replace("vec4 hook", f"{line}\nvec4 hook")),
        "parametrized": parametrized,
        "STORED": parametrized().to_dict(),
    }
    assert_refused(call, error, {**globals(), **names})


NOT_LOADED = """
import json, pickle, sys
import vkbloom
try:
    vkbloom.Settings.from_dict(json.loads(sys.argv[1]))
except ValueError as error:
    print(f"ValueError: {error}")
print(pickle.loads(bytes.fromhex(sys.argv[2])).radius)
"""


def test_a_method_is_registered_and_stored() -> None:
    text = "//!PARAM radius\n//!TYPE int\n//!MINIMUM 1\n//!MAXIMUM 30\n4\n" + COPY
    kind: Any = load_method(text, name="stored_one")
    settings = kind(radius=20)
    assert type(Settings.from_dict(settings.to_dict())) is kind
    assert Settings.from_json(settings.to_json()) == settings
    assert pickle.loads(pickle.dumps(settings)) == settings
    stored = settings.to_dict()
    assert len(stored["sha256"]) == 64
    load_method(text + "\n", name="stored_one")
    with pytest.raises(ValueError, match="has another text"):
        Settings.from_dict(stored)
    # A process that has not loaded it gets the text with a pickle, and not with a dictionary.
    printed = output("-c", NOT_LOADED, json.dumps(stored), pickle.dumps(settings).hex())
    assert re.fullmatch("ValueError: .*load_method.*\n20\n", printed), printed


def test_a_param_can_be_the_setting_of_the_reference_white(renderer: Renderer) -> None:
    text = "//!PARAM reference_white\n//!TYPE float\n//!MINIMUM 0\n//!MAXIMUM 1000\n100\n"
    settings = custom(text + COPY.replace("return", "return 0.01 * reference_white *"))
    image = picture(24, 16, highest=2)
    assert settings.reference_white == 100
    assert difference(renderer.apply(image, settings)["final"], image) < 1e-6
    doubled = renderer.apply(image, settings.replace(reference_white=200))
    assert difference(doubled["final"], 2 * image) < 1e-6
    for value in (0.5, 1001):
        with pytest.raises(ValueError, match="reference_white"):
            settings.replace(reference_white=value)


def test_params_mean_nothing_beyond_the_file(renderer: Renderer) -> None:
    """Methods of the package have fields of these names: a factor of the bloom, a rare one."""
    params = "".join(
        f"//!PARAM {name}\n//!TYPE float\n//!MINIMUM 0\n//!MAXIMUM 4\n0.5\n"
        for name in ("weight", "white")
    )
    body = "vec4 hook() { return weight * GLOW_tex(GLOW_pos); }\n"
    text = f"{params}//!HOOK MAIN\n//!BIND GLOW\n//!SAVE BLOOM\n{body}"

    def weighted(image: Array, settings: Any) -> dict[str, Array]:
        return {"bloom": settings.weight * image}

    kind = load_method(text, name="weighted", reference=weighted)
    image, settings = picture(24, 16, highest=2), kind(format="rgba32float")
    final = renderer.apply(image, settings)["final"]
    assert difference(final, reference.apply(image, settings)["final"]) < 1e-6
    everyday = {field["name"] for field in describe(kind)["fields"] if field["first"]}
    assert everyday >= {"weight", "white"}


@pytest.mark.parametrize("shading", ["forward", "deferred"])
def test_a_scene(renderer: Renderer, shading: Any) -> None:
    settings = custom(COPY.replace("return", "return 0.5 *"), format="rgba16float")
    frames = renderer.render(vkbloom.Scene.ufo(), settings, (48, 32), shading=shading)
    scene = frames["scene"][..., :3].astype(np.float64)
    drawn = scene if shading == "forward" else 255 * scene
    assert difference(frames["final"][..., :3], np.clip(0.5 * drawn, 0, 255)) <= 1


LEVEL = """\
//!HOOK MAIN
//!BIND GLOW
//!SAVE SMALL
//!WIDTH GLOW.w 2 /
//!HEIGHT GLOW.h 2 /
#include "vkbloom/sampling.glsl"
vec4 hook() {{ return {down}; }}
//!HOOK MAIN
//!BIND SMALL
//!SAVE BLOOM
//!WIDTH HOOKED.w
//!HEIGHT HOOKED.h
#include "vkbloom/sampling.glsl"
vec4 hook() {{ return {up}; }}
"""


@pytest.mark.parametrize(
    ("down", "up", "like"),
    [
        (
            "thirteen_taps(GLOW_raw, GLOW_pos)",
            "tent(SMALL_raw, SMALL_pos, 1.5)",
            vkbloom.Pyramid(levels=1, radius=1.5, format="rgba32float"),
        ),
        (
            "kawase_down(GLOW_raw, GLOW_pos, 1.25)",
            "kawase_up(SMALL_raw, SMALL_pos, 1.25)",
            vkbloom.DualKawase(levels=1, offset=1.25, format="rgba32float"),
        ),
    ],
    ids=["pyramid", "dual kawase"],
)
def test_the_filters_of_the_library(renderer: Renderer, down: str, up: str, like: Settings) -> None:
    image = picture(40, 24, highest=2)
    wanted = reference.apply(image, like)["bloom"]
    got = renderer.apply(image, custom(LEVEL.format(down=down, up=up)))["bloom"]
    assert difference(got[..., :3], wanted[..., :3]) < 3e-4


def test_the_threshold_of_the_library(renderer: Renderer) -> None:
    text = (
        '//!HOOK MAIN\n//!BIND HOOKED\n//!SAVE BLOOM\n#include "vkbloom/light.glsl"\n'
        "vec4 hook() {\n    vec4 c = HOOKED_texOff(0);\n"
        "    return vec4(c.rgb * above_threshold(c.rgb, 1.0, 0.5), 1.0);\n}\n"
    )
    image = picture(24, 16, highest=2)
    glow = renderer.apply(image, custom(text, threshold=1.0, knee=0.5))
    assert difference(glow["bloom"][..., :3], glow["glow"][..., :3]) < 1e-5
