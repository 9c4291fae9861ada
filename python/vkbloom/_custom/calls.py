"""Which functions of a module of SPIR-V call which."""

from __future__ import annotations

from collections.abc import Mapping

from vkbloom._custom.instructions import FUNCTION_CALL, Instruction, opcode_of


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
