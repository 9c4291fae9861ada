"""The blocks of a function of SPIR-V: what follows what, its loops, and what is before what."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

from vkbloom._custom.instructions import FUNCTION_END, Instruction, opcode_of

LOOP_MERGE, SELECTION_MERGE = 246, 247
LABEL, BRANCH, BRANCH_CONDITIONAL, SWITCH = 248, 249, 250, 251
CONSTANT_TRUE, CONSTANT_FALSE = 41, 42
#: OpReturn, OpReturnValue and what else ends a function or an invocation.
RETURNS: Final = (252, 253, 254, 4416)
RETURN, RETURN_VALUE, UNREACHABLE = 253, 254, 255
#: Instructions of blocks that have no result: stores, writes of images, barriers, atomic stores,
#: all that ends a block or is before its end, and OpDemoteToHelperInvocation.
WITHOUT_RESULT: Final = frozenset({62, 63, 64, 99, *range(218, 222), 224, 225, 228, 4416, 5380}) | {
    *range(LOOP_MERGE, UNREACHABLE + 1)
} - {LABEL}


@dataclasses.dataclass
class Function:
    """A function: its blocks, what follows each, and where each result is."""

    blocks: dict[int, list[Instruction]]
    follow: dict[int, list[int]]
    results: dict[int, tuple[int, Instruction]]

    @property
    def first(self) -> int | None:
        """The block with which it begins; None: it has none."""
        return next(iter(self.blocks), None)


def read_function(defined: Mapping[int, Instruction], body: list[Instruction]) -> Function:
    """Read a function. `defined`: constants, by which no way is that is never taken."""
    function = Function({}, {}, {})
    block = 0
    for word in body:
        opcode = opcode_of(word)
        if opcode == LABEL and len(word) == 2:
            block = word[1]
            function.follow[block] = []
            function.blocks[block] = []
            continue
        if block == 0 or opcode == FUNCTION_END:
            continue
        function.blocks[block].append(word)
        if len(word) > 2 and opcode not in WITHOUT_RESULT:
            function.results.setdefault(word[2], (block, word))
        if opcode == BRANCH and len(word) == 2:
            function.follow[block] = [word[1]]
        elif opcode == BRANCH_CONDITIONAL and len(word) > 3:
            condition = opcode_of(defined.get(word[1], (0,)))
            taken = {CONSTANT_TRUE: word[2:3], CONSTANT_FALSE: word[3:4]}
            function.follow[block] = [*taken.get(condition, word[2:4])]
        elif opcode == SWITCH and len(word) > 2:
            function.follow[block] = [*word[2::2]]
    for block, targets in function.follow.items():
        function.follow[block] = [each for each in targets if each in function.blocks]
    return function


def reach(follow: Mapping[int, list[int]], first: int) -> set[int]:
    """Return the blocks that are reached from one."""
    seen = {first}
    waiting = [first]
    for block in waiting:
        for target in follow[block]:
            if target not in seen:
                seen.add(target)
                waiting.append(target)
    return seen


def find_loops(function: Function, dominance: Dominance) -> dict[int, set[int]]:
    """Return the loops that are reached, by the block with which each begins, outer ones first."""
    loops: dict[int, set[int]] = {}
    for head in function.blocks:
        ends = [block for block in dominance.before(head) if dominance.is_before(head, block)]
        if not ends:
            continue
        loop = loops[head] = {head}
        for block in ends:
            if block not in loop:
                loop.add(block)
                ends += dominance.before(block)
    return loops


class Dominance:
    """Which blocks every way to a block leads through."""

    def __init__(self, function: Function) -> None:
        first = function.first
        self.reached = set() if first is None else reach(function.follow, first)
        self._before: dict[int, list[int]] = {}
        ordered = [block for block in function.blocks if block in self.reached]
        for block in ordered:
            for target in dict.fromkeys(function.follow[block]):
                self._before.setdefault(target, []).append(block)
        self._bit = {block: 1 << number for number, block in enumerate(ordered)}
        every = (1 << len(ordered)) - 1
        self._through = dict.fromkeys(ordered, every)
        if first is not None:
            self._through[first] = self._bit[first]
        changed = True
        while changed:
            changed = False
            for block in ordered[1:]:
                through = every
                for each in self.before(block):
                    through &= self._through[each]
                through |= self._bit[block]
                changed = changed or through != self._through[block]
                self._through[block] = through

    def before(self, block: int) -> list[int]:
        """Return the blocks that a block follows, but for those that are never reached."""
        return [*self._before.get(block, ())]

    def is_before(self, block: int, other: int) -> bool:
        """Whether all ways to another block lead through a block, or it is the same one.

        To a block that is never reached, all do.
        """
        return other not in self._through or bool(self._through[other] & self._bit.get(block, 0))
