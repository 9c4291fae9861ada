"""What a shader may take of a driver: its loops, its length, its memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from vkbloom._custom.calls import callees_first
from vkbloom._custom.flow import BRANCH_CONDITIONAL, SWITCH
from vkbloom._custom.instructions import Instruction, opcode_of, split, split_functions
from vkbloom._custom.rounds import limit_rounds
from vkbloom._custom.spirv import private_bytes

#: Instructions of a shader where what each call runs stands in its place, as drivers do it. Twenty
#: functions that each call the one before twice would take them minutes and gigabytes.
MAX_INSTRUCTIONS: Final = 1 << 18
#: Ways between which branches choose, counted likewise. Mesa's time grows with their square: 2000
#: cases of a switch take 1 s.
MAX_WAYS: Final = 1 << 13
#: Of a variable of an invocation, and of all. Mesa's time to compile an array grows with the square
#: of its length: 8 s for so many bytes.
MAX_VARIABLE_BYTES: Final = 32 << 10
MAX_PRIVATE_BYTES: Final = 128 << 10


def limit_shader(words: tuple[int, ...]) -> tuple[int, ...]:
    """Return a module whose loops end; raise ValueError for one that is too long or too large."""
    _, bodies = split_functions(split(words))
    calls = callees_first(bodies)
    lengths = {key: len(each) for key, each in bodies.items()}
    _check_sum(calls, lengths, MAX_INSTRUCTIONS, "instructions")
    ways = {key: sum(map(_count_ways, each)) for key, each in bodies.items()}
    _check_sum(calls, ways, MAX_WAYS, "branches")
    sizes = private_bytes(words)
    for size, most, what in (
        (max(sizes, default=0), MAX_VARIABLE_BYTES, "a variable"),
        (sum(sizes), MAX_PRIVATE_BYTES, "all variables"),
    ):
        if size > most:
            raise ValueError(f"{what} of an invocation: {size} bytes are more than {most}")
    return limit_rounds(words)


def _count_ways(word: Instruction) -> int:
    if opcode_of(word) == SWITCH:
        return len(word) // 2
    return int(opcode_of(word) == BRANCH_CONDITIONAL)


def _check_sum(
    calls: Mapping[int, list[int]], counts: Mapping[int, int], most: int, what: str
) -> None:
    """Raise ValueError if a function has too much of something, with all that it calls."""
    sums: dict[int, int] = {}
    for identity, called in calls.items():
        sums[identity] = counts[identity] + sum(sums.get(each, 0) for each in called)
        if sums[identity] > most:
            raise ValueError(
                f"the shader has more than {most} {what}, those of a function at each call"
            )
