"""The instructions of a module of SPIR-V, and the opcodes by which its functions are read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from vkbloom._custom.spirv import HEADER_WORDS

#: The words of an instruction. The first has the opcode in its lower half.
Instruction = tuple[int, ...]

CONSTANTS: Final = range(41, 53)
FUNCTION, FUNCTION_END, FUNCTION_CALL, VARIABLE = 54, 56, 57, 59
LOAD: Final = 61
STORE: Final = 62
ACCESS_CHAINS: Final = (65, 66)


def opcode_of(word: Instruction) -> int:
    """Return what an instruction is."""
    return word[0] & 0xFFFF


def instruction(opcode: int, *operands: int) -> Instruction:
    """Return an instruction."""
    return ((len(operands) + 1) << 16 | opcode, *operands)


def split(words: tuple[int, ...]) -> Iterator[Instruction]:
    """Yield the instructions of a module; ValueError: it ends within one."""
    position = HEADER_WORDS
    while position < len(words):
        end = position + (words[position] >> 16)
        if end == position or end > len(words):
            raise ValueError("the SPIR-V ends within an instruction")
        yield words[position:end]
        position = end


def split_functions(
    instructions: Iterable[Instruction],
) -> tuple[list[Instruction], dict[int, list[Instruction]]]:
    """Return what a compiler's module declares, and the instructions of each function by its id."""
    declared: list[Instruction] = []
    bodies: dict[int, list[Instruction]] = {}
    into = declared
    for word in instructions:
        if opcode_of(word) == FUNCTION:
            into = bodies[word[2]] = []
        into.append(word)
    return declared, bodies
