"""SPIR-V whose loops end: a counter of their rounds leaves them, and outputs become NaN.

An invocation has one counter for all of its loops, so that loops within loops have the same limit.
Each round begins with a look at it. At the limit the loop is left, as `break` does, and so are all
loops after it. What an invocation writes then is not what its shader means; NaN says so. Loops of a
few rounds between constants are not counted: a loop around them adds their rounds to its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from vkbloom._custom.calls import callees_first
from vkbloom._custom.counter import CountedModule
from vkbloom._custom.flow import LOOP_MERGE, Dominance, find_loops, read_function
from vkbloom._custom.instructions import FUNCTION_CALL, opcode_of, split
from vkbloom._custom.trips import Trips

#: Rounds of all loops of an invocation: those of 511 x 511 taps.
MAX_ROUNDS: Final = 1 << 18
#: Of loops between constants, with the loops in them, which are not counted.
MAX_UNCOUNTED: Final = 4096

#: OpLine and OpNoLine, which may be between blocks.
_LINES: Final = (8, 317)


def limit_rounds(
    words: tuple[int, ...], most: int = MAX_ROUNDS, uncounted: int = MAX_UNCOUNTED
) -> tuple[int, ...]:
    """Return a module whose invocations run at most so many rounds of loops that are counted.

    ValueError: a loop has not the structure that SPIR-V demands.
    """
    instructions = [word for word in split(words) if opcode_of(word) not in _LINES]
    if not any(opcode_of(word) == LOOP_MERGE for word in instructions):
        return words
    module = CountedModule(words, instructions, most)
    costs: dict[int, int] = {}
    for identity in callees_first(module.bodies):
        costs[identity] = _limit_function(module, identity, costs, uncounted)
    return module.assemble() if module.counter else words


def _limit_function(
    module: CountedModule, identity: int, costs: Mapping[int, int], uncounted: int
) -> int:
    """Count the rounds of the loops of a function; return the number of those not counted."""
    function = module.functions[identity] = read_function({}, module.bodies[identity])
    dominance = Dominance(function)
    loops = find_loops(function, dominance)
    trips = Trips(module.defined, function, dominance, loops)
    # Inner loops come after the loops around them.
    inner_first = [*reversed(loops)]
    around = {block: head for head in loops for block in loops[head]}
    cost = dict.fromkeys((*loops, 0), 0)
    for block, instructions in function.blocks.items():
        called = (word[3] for word in instructions if opcode_of(word) == FUNCTION_CALL)
        cost[around.get(block, 0)] += sum(costs.get(each, 0) for each in called)
    counted = []
    for head in inner_first:
        ends = [each for each in dominance.before(head) if dominance.is_before(head, each)]
        if len(ends) != 1:
            raise ValueError("a loop of the SPIR-V has several ends")
        weight = min(1 + cost[head], module.most)
        count = trips.count(head, ends[0], uncounted // weight)
        if count is None:
            counted.append((head, weight))
            continue
        outer = (each for each in inner_first if each != head and head in loops[each])
        cost[next(outer, 0)] += count * weight
    for head, weight in counted:
        module.count(function, loops, head, weight)
    if counted:
        module.end_all(function, identity, dominance.reached)
    return min(cost[0], module.most)
