"""The functions of a module of SPIR-V: which call which, and how long that makes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from vkbloom._custom.instructions import FUNCTION_CALL, Instruction, opcode_of

#: Instructions of a shader where what each call runs stands in its place, as drivers do it. Twenty
#: functions that each call the one before twice would take them minutes and gigabytes.
MAX_INSTRUCTIONS: Final = 1 << 18


def callees_first(bodies: Mapping[int, list[Instruction]]) -> dict[int, list[int]]:
    """Return the calls of each function, in an order in which it comes after those it calls."""
    calls = {
        identity: [word[3] for word in body if opcode_of(word) == FUNCTION_CALL]
        for identity, body in bodies.items()
    }
    ordered: dict[int, list[int]] = {}
    seen: set[int] = set()
    for first in bodies:
        waiting = [first]
        while waiting:
            identity = waiting[-1]
            missing = [each for each in calls[identity] if each in bodies and each not in seen]
            if identity in seen and not missing:
                waiting.pop()
                ordered.setdefault(identity, calls[identity])
            seen.add(identity)
            waiting += missing[:1]
    return ordered


def check_length(bodies: Mapping[int, list[Instruction]]) -> None:
    """Raise ValueError if a function is too long with all that it calls in place of the calls."""
    lengths: dict[int, int] = {}
    for identity, called in callees_first(bodies).items():
        inner = sum(lengths.get(each, 0) for each in called)
        lengths[identity] = len(bodies[identity]) + inner
        if lengths[identity] > MAX_INSTRUCTIONS:
            raise ValueError(
                f"the shader runs more than {MAX_INSTRUCTIONS} instructions, those of a function "
                "at each of its calls"
            )
