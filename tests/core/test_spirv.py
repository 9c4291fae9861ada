"""The SPIR-V of the core's shaders: the decorations that every compiler needs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vkbloom import _core
from vkbloom._doctor.deviations import _SINGLE

MAGIC = 0x07230203
HEADER_WORDS = 5
DECORATE, FUNCTION, FUNCTION_END, EXTENDED = 71, 54, 56, 12
NO_CONTRACTION = 42
# OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv, OpFRem, OpFMod, and from OpVectorTimesScalar to OpDot.
FLOAT_ARITHMETIC = {127, 129, 131, 133, 136, 140, 141, *range(142, 149)}


def modules() -> Iterator[tuple[bytes, list[tuple[int, ...]]]]:
    """Yield each module that the core holds, and its instructions."""
    data = Path(_core.__file__).read_bytes()
    words = np.frombuffer(data[: len(data) // 4 * 4], np.uint32)
    for start in np.flatnonzero(words == MAGIC):
        # The core also compares with this number.
        if words[start + 1] & 0xFFFF00FF != 0x00010000:
            continue
        position = int(start) + HEADER_WORDS
        instructions: list[tuple[int, ...]] = []
        # A module ends with its last function.
        while not (
            instructions
            and instructions[-1][0] & 0xFFFF == FUNCTION_END
            and words[position] & 0xFFFF != FUNCTION
        ):
            length = int(words[position]) >> 16
            instructions.append(tuple(map(int, words[position : position + length])))
            position += length
        yield words[start:position].tobytes(), instructions


def test_no_operation_on_floats_may_be_contracted() -> None:
    counts = []
    for _, instructions in modules():
        decorated = {
            words[1]
            for words in instructions
            if words[0] & 0xFFFF == DECORATE and words[2] == NO_CONTRACTION
        }
        results = {words[2] for words in instructions if words[0] & 0xFFFF in FLOAT_ARITHMETIC}
        assert results == decorated
        counts.append(len(results))
    assert len(counts) > 60, "modules were not found"
    assert sum(counts) > 2000, "operations were not found"


def test_no_function_has_an_absolute_error() -> None:
    """Vulkan allows sine and cosine an error of 2^-11, and SwiftShader has it."""
    # Of GLSL.std.450: trigonometry, from Sin to Atan2.
    used = {
        words[4]
        for _, instructions in modules()
        for words in instructions
        if words[0] & 0xFFFF == EXTENDED
    }
    assert len(used) > 5, "functions were not found"
    assert not used & set(range(13, 26))


#: What Vulkan lets a device compute loosely, beside quotients (2.5 units in the last place).
LOOSE: dict[str, str] = {
    "adjoint_composite.glsl": "exp2 log",
    "adjoint_godot_blur.frag": "exp2",
    "adjoint_godot_final.frag": "exp2 sqrt",
    "adjoint_strip.comp": "exp2",
    "adjoint_tile.comp": "exp2",
    "composite.glsl": "exp2",
    "flare.glsl": "length pow",
    "gbuffer_mesh.glsl": "length",
    "godot.glsl": "exp2",
    "godot_blend.glsl": "sqrt",
    "godot_final.frag": "exp2",
    "lab.glsl": "pow",
    "lighting.frag": "normalize",
    "lit_mesh.glsl": "normalize",
    "phong.glsl": "normalize pow",
    "prefilters.glsl": "pow",
    "rounding.glsl": "pow",
    "sun_beams.frag": "length",
    "tonemap.glsl": "exp log log2 pow sqrt",
    "tonemap_slopes.glsl": "exp log log2 pow sqrt",
}
UNIT = 2.0**-23


def exp2_error(size: float) -> float:
    """Return the relative error that Vulkan allows 2 to the power of up to `size`."""
    return (3 + 2 * size) * UNIT


def power_error(exponent: float, logarithm: float) -> float:
    """Return that of a power of values whose logarithms to base 2 are up to `logarithm`."""
    of_logarithm = max(2.0**-21, 3 * UNIT * logarithm)
    return exp2_error(exponent * logarithm) + float(np.log(2)) * exponent * of_logarithm


def test_every_loose_function_is_listed_and_within_the_promise() -> None:
    """A function that is not listed needs a bound below, or a formula of its own."""
    folders = (Path(__file__).parents[2] / "shaders", Path(_core.__file__).parent / "_custom/glsl")
    names = "a?(sin|cos|tan)h?|pow|exp2?|log2?|sqrt|inversesqrt|length|distance|normalize|inverse"
    found = {
        file.name: " ".join(sorted({match[1] for match in re.finditer(rf"\b({names})\(", text)}))
        for folder in folders
        for file in folder.rglob("*.*")
        for text in [re.sub(r"//.*", "", file.read_text())]
    }
    assert {name: used for name, used in found.items() if used} == LOOSE
    bounds = {
        "exposure": exp2_error(32),
        # Of what half floats hold, and of single floats in light that a curve has compressed.
        "srgb, gamma22": power_error(1 / 2.2, 24),
        "agx": power_error(2.2, 24) + UNIT * 2.5,
        # From 1e-5 cd/m2 on; the second base is between C1 and 1.
        "pq": power_error(0.159, 30) * 78.84 * 0.16 + power_error(78.84, float(-np.log2(0.8359))),
        "phong": power_error(8, 16),
        "length, normalize, sqrt": 2 * 2.5 * UNIT,
    }
    assert all(bound < _SINGLE for bound in bounds.values()), bounds


def test_loops_over_arrays_are_unrolled() -> None:
    # Mesa 25 unrolls only what it is told to. An array indexed by the counter of another loop is
    # in memory, which makes a pass take up to five times as long. The loop over rows, columns,
    # chunks or texels of an invocation is the only one that is not unrolled.
    rows = re.compile(r"for \(int (y|chunk|number) = |^    for \(int x = first\.x - STRIP_RADIUS;")
    checked = 0
    for shader in sorted((Path(__file__).parents[2] / "shaders" / "variants").iterdir()):
        lines = shader.read_text().splitlines()
        # Only GPUs run tiles.
        loops = [line for line in lines if "for (" in line and "tile" not in shader.name]
        checked += len(loops)
        for line in loops:
            assert rows.search(line) or "[[unroll]] for (" in line, (shader.name, line)
    assert checked > 50, "the loops were not found"
