"""The SPIR-V of the core's shaders: the decorations that every compiler needs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vkbloom import _core

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


def test_loops_over_arrays_are_unrolled() -> None:
    # Mesa 25 unrolls only what it is told to. An array indexed by the counter of another loop is
    # in memory, which makes a pass take up to five times as long. The loop over rows, columns,
    # chunks or texels of an invocation is the only one that is not unrolled.
    rows = re.compile(
        r"for \(int (y|chunk|number|round) = "
        r"|^    for \(int x = first\.x - STRIP_RADIUS;"
    )
    checked = 0
    for shader in sorted((Path(__file__).parents[2] / "shaders" / "variants").iterdir()):
        lines = shader.read_text().splitlines()
        # Only GPUs run tiles.
        loops = [line for line in lines if "for (" in line and "tile" not in shader.name]
        checked += len(loops)
        for line in loops:
            told = "[[unroll]] for (" in line or "[[dont_unroll]] for (" in line
            assert rows.search(line) or told, (shader.name, line)
    assert checked > 50, "the loops were not found"


LABEL, LOOP_MERGE, SELECTION_MERGE, BRANCH, CONDITIONAL, SWITCH = 248, 246, 247, 249, 250, 251


def has_calls_in_its_condition(blocks: dict[int, list[tuple[int, ...]]], header: int) -> bool:
    """Whether a switch lies between a loop's header and the branch that leaves it.

    spirv-opt makes a switch of one case of a function with several ends. A loop that ends with
    its condition, in its continue block, has run its body before.
    """
    (merge, end), place, switched = blocks[header][-2][1:3], header, False
    while place != end:
        *_, before, last = ((0,), *blocks[place])
        code = last[0] & 0xFFFF
        if code == CONDITIONAL and merge in last[2:4]:
            return switched
        switched |= code == SWITCH
        if before[0] & 0xFFFF == SELECTION_MERGE or (place != header and is_loop(before)):
            place = before[1]
        elif code == BRANCH:
            place = last[1]
        else:
            return False
    return False


def is_loop(words: tuple[int, ...]) -> bool:
    return words[0] & 0xFFFF == LOOP_MERGE


def test_no_loop_has_a_call_in_its_condition() -> None:
    """lavapipe 22.3.6 leaves such a loop early if the core does not fold the module's constants.

    A sum over groups made 3 rounds of group_count() = 5: write the count in a constant, or unroll
    the loop and compare in it.
    """
    loops = 0
    for _, instructions in modules():
        blocks: dict[int, list[tuple[int, ...]]] = {}
        for words in instructions:
            if words[0] & 0xFFFF == LABEL:
                block = blocks[words[1]] = []
            elif blocks:
                block.append(words)
        for label, block in blocks.items():
            if any(map(is_loop, block)):
                loops += 1
                assert not has_calls_in_its_condition(blocks, label)
    assert loops > 1000, "loops were not found"
