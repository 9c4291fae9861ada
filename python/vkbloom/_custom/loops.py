"""Loops of SPIR-V that do not end: none of their exits is ever taken, or changes its mind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from vkbloom._custom.flow import (
    BRANCH_CONDITIONAL,
    RETURNS,
    SWITCH,
    Dominance,
    Function,
    find_loops,
    read_function,
)
from vkbloom._custom.instructions import (
    ACCESS_CHAINS,
    CONSTANTS,
    FUNCTION_CALL,
    LOAD,
    VARIABLE,
    Instruction,
    opcode_of,
    split,
    split_functions,
)
from vkbloom._custom.spirv import LOCAL, PRIVATE

ALL, EQUAL = 155, 170
#: Constants and variables.
_DECLARED: Final = (*CONSTANTS, VARIABLE)
#: Storage classes: what is the same for all of a run, and what a function may change.
_STEADY: Final = (0, 1, 2, 9)
#: Instructions whose result depends on their operands alone.
_PURE: Final = frozenset(
    {12, 79, 80, 81, 82, 83, *range(109, 153), *range(154, 192), *range(194, 206)}
)
_MAX_WORD: Final = 0xFFFFFFFF


def has_endless_loop(words: tuple[int, ...]) -> bool:
    """Whether a function of a module has a loop that does not end; the module is a compiler's."""
    declared, bodies = split_functions(split(words))
    defined = {word[2]: word for word in declared if opcode_of(word) in _DECLARED}
    return any(is_endless(defined, body) for body in bodies.values())


def is_endless(defined: Mapping[int, Instruction], body: list[Instruction]) -> bool:
    """Whether a function has a loop that does not end once it has begun its second round.

    `defined`: The declarations of the module, by their ids.
    """
    function = read_function(defined, body)
    if function.first is None:
        return False
    dominance = Dominance(function)
    if not any(opcode_of(function.blocks[each][-1]) in RETURNS for each in dominance.reached):
        return True  # also where an optimizer has left an endless loop out
    for loop in find_loops(function, dominance).values():
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


def _condition(function: Function, block: int) -> int | None:
    """Return what decides where a block leads; None if it always leads out."""
    last = function.blocks[block][-1]
    return last[1] if opcode_of(last) in (BRANCH_CONDITIONAL, SWITCH) else None


class _Check:
    """Whether values change from round to round of a loop."""

    def __init__(
        self, defined: Mapping[int, Instruction], function: Function, loop: set[int]
    ) -> None:
        self._defined = defined
        self._results = function.results
        self._loop = loop
        self._seen: dict[int, bool] = {}
        body = [word for block in loop for word in function.blocks[block]]
        self._calls = any(opcode_of(word) == FUNCTION_CALL for word in body)
        #: Ids that instructions of the loop mention, but for reading.
        self._changed = {
            each
            for word in body
            if opcode_of(word) not in (LOAD, *ACCESS_CHAINS)
            for each in word[1:]
        }
        # A pointer into a variable, which is written, changes the variable.
        waiting = [*self._changed]
        for each in waiting:
            _, word = self._results.get(each, (0, (0,)))
            if opcode_of(word) in ACCESS_CHAINS and len(word) > 3 and word[3] not in self._changed:
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
        opcode = opcode_of(word)
        if opcode == LOAD and len(word) > 3:
            return self._is_kept(word[3], depth)
        return opcode in _PURE and all(self.is_steady(each, depth) for each in word[3:])

    def _is_kept(self, pointer: int, depth: int) -> bool:
        """Whether nothing in the loop writes what a pointer leads to."""
        _, word = self._results.get(pointer, (0, (0,)))
        if opcode_of(word) in ACCESS_CHAINS and len(word) > 3:
            return self._is_kept(word[3], depth) and all(
                self.is_steady(each, depth) for each in word[4:]
            )
        variable = self._defined.get(pointer, word)
        if opcode_of(variable) != VARIABLE or len(variable) < 4:
            return False
        storage = variable[3]
        if storage in _STEADY:
            return True
        steady = storage == LOCAL or (storage == PRIVATE and not self._calls)
        return steady and pointer not in self._changed

    def is_bound(self, identity: int) -> bool:
        """Whether a condition is naga's own, which ends each loop after 2**64 rounds."""
        _, word = self._results.get(identity, (0, (0,)))
        if opcode_of(word) != ALL or len(word) < 4:
            return False
        _, equal = self._results.get(word[3], (0, (0,)))
        if opcode_of(equal) != EQUAL:
            return False
        for each in equal[3:]:
            _, load = self._results.get(each, (0, (0,)))
            _, variable = self._results.get((*load, 0, 0, 0, 0)[3], (0, (0,)))
            if opcode_of(load) == LOAD and len(variable) > 4:
                parts = self._defined.get(variable[4], ())[3:]
                words = [self._defined.get(part, ())[3:4] for part in parts]
                return words == [(_MAX_WORD,)] * 2
        return False
