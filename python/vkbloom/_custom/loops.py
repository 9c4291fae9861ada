"""Loops of SPIR-V that do not end: none of their exits is ever taken, or changes its mind."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Final

from vkbloom._custom.instructions import (
    ACCESS_CHAINS,
    CONSTANTS,
    FUNCTION,
    FUNCTION_CALL,
    FUNCTION_END,
    LOAD,
    VARIABLE,
    Instruction,
    split,
)

LABEL, BRANCH, BRANCH_CONDITIONAL, SWITCH = 248, 249, 250, 251
CONSTANT_TRUE, CONSTANT_FALSE = 41, 42
ALL, EQUAL = 155, 170
#: Constants and variables.
_DECLARED: Final = (*CONSTANTS, VARIABLE)
_RETURNS: Final = (252, 253, 254, 4416)
#: Storage classes: what is the same for all of a run, and what a function may change.
_STEADY: Final = (0, 1, 2, 9)
_FUNCTION, _PRIVATE = 7, 6
#: Instructions whose result depends on their operands alone.
_PURE: Final = frozenset(
    {12, 79, 80, 81, 82, 83, *range(109, 153), *range(154, 192), *range(194, 206)}
)
_MAX_WORD: Final = 0xFFFFFFFF


@dataclasses.dataclass
class _Function:
    """A function: its blocks, what follows each, and where each result is."""

    blocks: dict[int, list[Instruction]]
    follow: dict[int, list[int]]
    results: dict[int, tuple[int, Instruction]]


def has_endless_loop(words: tuple[int, ...]) -> bool:
    """Whether a function of a module has a loop that does not end; the module is a compiler's."""
    defined: dict[int, Instruction] = {}
    bodies: list[list[Instruction]] = []
    for word in split(words):
        if word[0] & 0xFFFF == FUNCTION:
            bodies.append([])
        if bodies:
            bodies[-1].append(word)
        elif word[0] & 0xFFFF in _DECLARED and len(word) > 2:
            defined[word[2]] = word
    return any(is_endless(defined, body) for body in bodies)


def is_endless(defined: Mapping[int, Instruction], body: list[Instruction]) -> bool:
    """Whether a function has a loop that does not end once it has begun its second round.

    `defined`: The declarations of the module, by their ids.
    """
    function = _read(defined, body)
    first = next(iter(function.blocks), None)
    if first is None:
        return False
    reached = _reach(function.follow, first)
    if not any(function.blocks[each][-1][0] & 0xFFFF in _RETURNS for each in reached):
        return True  # also where an optimizer has left an endless loop out
    for loop in _loops(function, reached):
        exits = [
            (block, target)
            for block in loop
            for target in function.follow[block]
            if target not in loop
        ]
        checks = [_condition(function, block) for block, _ in exits]
        check = _Check(defined, function, loop)
        if all(
            found is not None and (check.is_steady(found) or check.is_bound(found))
            for found in checks
        ):
            return True
    return False


def _read(defined: Mapping[int, Instruction], body: list[Instruction]) -> _Function:
    function = _Function({}, {}, {})
    block = 0
    for word in body:
        opcode = word[0] & 0xFFFF
        if opcode == LABEL and len(word) == 2:
            block = word[1]
            function.follow[block] = []
            function.blocks[block] = []
            continue
        if block == 0 or opcode == FUNCTION_END:
            continue
        function.blocks[block].append(word)
        if len(word) > 2:
            function.results.setdefault(word[2], (block, word))
        if opcode == BRANCH and len(word) == 2:
            function.follow[block] = [word[1]]
        elif opcode == BRANCH_CONDITIONAL and len(word) > 3:
            condition = defined.get(word[1], (0,))[0] & 0xFFFF
            taken = {CONSTANT_TRUE: word[2:3], CONSTANT_FALSE: word[3:4]}
            function.follow[block] = [*taken.get(condition, word[2:4])]
        elif opcode == SWITCH and len(word) > 2:
            function.follow[block] = [*word[2::2]]
    for block, targets in function.follow.items():
        function.follow[block] = [each for each in targets if each in function.blocks]
    return function


def _loops(function: _Function, reached: set[int]) -> Iterable[set[int]]:
    """Return the loops among the blocks that are reached."""
    before: dict[int, list[int]] = {}
    for block in reached:
        for target in function.follow[block]:
            before.setdefault(target, []).append(block)
    # A block that is followed by one that comes before it begins a loop, and loops within it.
    order = {block: number for number, block in enumerate(function.blocks)}
    heads = {
        target
        for block in reached
        for target in function.follow[block]
        if order[target] <= order[block]
    }
    return [_natural(before, order, head, reached) for head in sorted(heads, key=order.__getitem__)]


def _natural(
    before: Mapping[int, list[int]], order: Mapping[int, int], head: int, reached: set[int]
) -> set[int]:
    """Return the blocks of the loop that begins with a block."""
    loop = {head}
    waiting = [block for block in before[head] if order[block] >= order[head]]
    for block in waiting:
        if block not in loop and block in reached:
            loop.add(block)
            waiting += before.get(block, [])
    return loop


def _reach(follow: Mapping[int, list[int]], first: int) -> set[int]:
    seen = {first}
    waiting = [first]
    for block in waiting:
        for target in follow[block]:
            if target not in seen:
                seen.add(target)
                waiting.append(target)
    return seen


def _condition(function: _Function, block: int) -> int | None:
    """Return what decides where a block leads; None if it always leads out."""
    last = function.blocks[block][-1]
    return last[1] if last[0] & 0xFFFF in (BRANCH_CONDITIONAL, SWITCH) else None


class _Check:
    """Whether values change from round to round of a loop."""

    def __init__(
        self, defined: Mapping[int, Instruction], function: _Function, loop: set[int]
    ) -> None:
        self._defined = defined
        self._results = function.results
        self._loop = loop
        self._seen: dict[int, bool] = {}
        body = [word for block in loop for word in function.blocks[block]]
        self._calls = any(word[0] & 0xFFFF == FUNCTION_CALL for word in body)
        #: Ids that instructions of the loop mention, but for reading.
        self._changed = {
            each
            for word in body
            if word[0] & 0xFFFF not in (LOAD, *ACCESS_CHAINS)
            for each in word[1:]
        }
        # A pointer into a variable, which is written, changes the variable.
        waiting = [*self._changed]
        for each in waiting:
            _, word = self._results.get(each, (0, (0,)))
            if word[0] & 0xFFFF in ACCESS_CHAINS and len(word) > 3 and word[3] not in self._changed:
                self._changed.add(word[3])
                waiting.append(word[3])

    def is_steady(self, identity: int, depth: int = 0) -> bool:
        """Whether a value is the same in each round."""
        block, word = self._results.get(identity, (0, (0,)))
        if block not in self._loop:
            return True
        if identity not in self._seen:
            self._seen[identity] = depth < 64 and self._is_steady(word, depth + 1)
        return self._seen[identity]

    def _is_steady(self, word: Instruction, depth: int) -> bool:
        opcode = word[0] & 0xFFFF
        if opcode == LOAD and len(word) > 3:
            return self._is_kept(word[3], depth)
        return opcode in _PURE and all(self.is_steady(each, depth) for each in word[3:])

    def _is_kept(self, pointer: int, depth: int) -> bool:
        """Whether nothing in the loop writes what a pointer leads to."""
        _, word = self._results.get(pointer, (0, (0,)))
        if word[0] & 0xFFFF in ACCESS_CHAINS and len(word) > 3:
            return self._is_kept(word[3], depth) and all(
                self.is_steady(each, depth) for each in word[4:]
            )
        variable = self._defined.get(pointer, word)
        if variable[0] & 0xFFFF != VARIABLE or len(variable) < 4:
            return False
        storage = variable[3]
        if storage in _STEADY:
            return True
        steady = storage == _FUNCTION or (storage == _PRIVATE and not self._calls)
        return steady and pointer not in self._changed

    def is_bound(self, identity: int) -> bool:
        """Whether a condition is naga's own, which ends each loop after 2**64 rounds."""
        _, word = self._results.get(identity, (0, (0,)))
        if word[0] & 0xFFFF != ALL or len(word) < 4:
            return False
        _, equal = self._results.get(word[3], (0, (0,)))
        if equal[0] & 0xFFFF != EQUAL:
            return False
        for each in equal[3:]:
            _, load = self._results.get(each, (0, (0,)))
            _, variable = self._results.get((*load, 0, 0, 0, 0)[3], (0, (0,)))
            if load[0] & 0xFFFF == LOAD and len(variable) > 4:
                parts = self._defined.get(variable[4], ())[3:]
                words = [self._defined.get(part, ())[3:4] for part in parts]
                return words == [(_MAX_WORD,)] * 2
        return False
