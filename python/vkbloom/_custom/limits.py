"""What a shader may take of a driver: its loops, its length, its memory."""

from __future__ import annotations

from typing import Final

from vkbloom._custom.calls import callees_first
from vkbloom._custom.instructions import FUNCTION, Instruction, opcode_of, split
from vkbloom._custom.rounds import limit_rounds
from vkbloom._custom.spirv import private_bytes

#: Instructions of a shader where what each call runs stands in its place, as drivers do it. Twenty
#: functions that each call the one before twice would take them minutes and gigabytes.
MAX_INSTRUCTIONS: Final = 1 << 18
#: Of the variables of an invocation. Mesa compiles arrays in a time that grows with the square of
#: their length: 8 s for so many bytes.
MAX_PRIVATE_BYTES: Final = 32 << 10


def limit_shader(words: tuple[int, ...]) -> tuple[int, ...]:
    """Return a module whose loops end; raise ValueError for one that is too long or too large."""
    bodies: dict[int, list[Instruction]] = {}
    body: list[Instruction] = []
    for word in split(words):
        if opcode_of(word) == FUNCTION:
            body = bodies[word[2]] = []
        body.append(word)
    lengths: dict[int, int] = {}
    for identity, called in callees_first(bodies).items():
        lengths[identity] = len(bodies[identity]) + sum(lengths.get(each, 0) for each in called)
        if lengths[identity] > MAX_INSTRUCTIONS:
            raise ValueError(
                f"the shader runs more than {MAX_INSTRUCTIONS} instructions, those of a function "
                "at each of its calls"
            )
    size = private_bytes(words)
    if size > MAX_PRIVATE_BYTES:
        raise ValueError(
            f"the variables of an invocation have {size} bytes, more than {MAX_PRIVATE_BYTES}"
        )
    return limit_rounds(words)
