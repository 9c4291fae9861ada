"""SPIR-V whose loops end: a counter of their rounds leaves them, and outputs become NaN.

An invocation has one counter for all of its loops, so that loops within loops have the same limit.
It counts a round where it goes back to the head of the loop. There it leaves, as `break` does, once
the counter has reached the limit, and so do all loops after it. What an invocation writes then is
not what its shader means; NaN says so. Loops of a few rounds between constants are not counted: a
loop around them adds their rounds to its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from vkbloom._custom.flow import (
    BRANCH_CONDITIONAL,
    LABEL,
    LOOP_MERGE,
    RETURN,
    RETURN_VALUE,
    SELECTION_MERGE,
    SWITCH,
    UNREACHABLE,
    Dominance,
    Function,
    find_loops,
    read_function,
)
from vkbloom._custom.instructions import (
    CONSTANTS,
    FUNCTION,
    FUNCTION_CALL,
    FUNCTION_END,
    LOAD,
    STORE,
    VARIABLE,
    Instruction,
    instruction,
    opcode_of,
    split,
)
from vkbloom._custom.spirv import HEADER_WORDS
from vkbloom._custom.trips import TYPE_BOOL, TYPE_FLOAT, TYPE_INT, Trips

#: Rounds of all loops of an invocation: those of 511 x 511 taps.
MAX_ROUNDS: Final = 1 << 18
#: Of loops between constants, with the loops in them, which are not counted.
MAX_UNCOUNTED: Final = 4096

_ENTRY_POINT, _DECORATE, _TYPE_VOID, _TYPE_VECTOR, _TYPE_POINTER = 15, 71, 19, 23, 32
_CONSTANT, _COMPOSITE, _CONSTANT_NULL, _PHI, _IMAGE_WRITE = 43, 44, 46, 245, 99
_CONSTRUCT, _ADD, _SELECT, _NOT_LESS, _NOT, _AND, _OR = 80, 128, 169, 174, 168, 167, 166
_OUTPUT, _PRIVATE, _LOCATION, _FRAGMENT = 3, 6, 30, 4
#: OpLine and OpNoLine, which may be between blocks.
_LINES: Final = (8, 317)
#: From this version on, an entry point lists all variables that it uses.
_ALL_LISTED: Final = 0x10400
_NAN: Final = {16: 0x7E00, 32: 0x7FC00000}
#: Types without a null: images, samplers, pointers.
_OPAQUE: Final = (25, 26, 27, _TYPE_POINTER)
#: Where instructions have literals: those before a place are ids, but for the first one; a place
#: that is negative has the only literal.
_LITERALS: Final[Mapping[int, int]] = {
    12: -4,  # OpExtInst
    VARIABLE: -3,
    LOAD: 4,
    STORE: 3,
    63: 3,
    79: 5,  # OpVectorShuffle
    81: 4,
    82: 5,
    **dict.fromkeys((87, 88, 91, 92, 95, 98), -5),  # masks of what an image is given
    **dict.fromkeys((89, 90, 93, 94, 96, 97), -6),
    _IMAGE_WRITE: -4,
    **dict.fromkeys(range(349, 365), -4),  # of subgroups
    BRANCH_CONDITIONAL: 4,
    LOOP_MERGE: 3,
    SELECTION_MERGE: 2,
    SWITCH: 2,
}


def limit_rounds(
    words: tuple[int, ...], most: int = MAX_ROUNDS, uncounted: int = MAX_UNCOUNTED
) -> tuple[int, ...]:
    """Return a module whose invocations run at most so many rounds of loops that are counted.

    ValueError: a loop has not the structure that SPIR-V demands.
    """
    instructions = [word for word in split(words) if opcode_of(word) not in _LINES]
    if not any(opcode_of(word) == LOOP_MERGE for word in instructions):
        return words
    module = _Module(words, instructions, most)
    bodies = module.bodies
    costs: dict[int, int] = {}
    for identity in _callees_first(bodies):
        costs[identity] = _limit_function(module, identity, costs, uncounted)
    return module.assemble() if module.counter else words


def _callees_first(bodies: Mapping[int, list[Instruction]]) -> list[int]:
    """Return the functions of a module, each after those that it calls."""
    calls = {
        identity: [word[3] for word in body if opcode_of(word) == FUNCTION_CALL]
        for identity, body in bodies.items()
    }
    ordered: dict[int, None] = {}
    seen: set[int] = set()
    for first in bodies:
        waiting = [first]
        while waiting:
            identity = waiting[-1]
            missing = [each for each in calls[identity] if each in bodies and each not in seen]
            if identity in seen and not missing:
                ordered.setdefault(waiting.pop())
            seen.add(identity)
            waiting += missing[:1]
    return [*ordered]


def _limit_function(
    module: _Module, identity: int, costs: Mapping[int, int], uncounted: int
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
            counted.append((head, ends[0], weight))
            # After the limit, its first round still runs each time that it begins.
            count = 1
        outer = (each for each in inner_first if each != head and head in loops[each])
        cost[next(outer, 0)] += count * weight
    for head, end, weight in counted:
        module.count(function, loops[head], head, end, weight)
    if counted:
        module.end_all(function, identity, dominance.reached)
    return min(cost[0], module.most)


class _Module:
    """A module whose functions are changed, and what it declares for that."""

    def __init__(self, words: tuple[int, ...], instructions: list[Instruction], most: int) -> None:
        self.most = most
        self.bodies: dict[int, list[Instruction]] = {}
        self.functions: dict[int, Function] = {}
        self.defined: dict[int, Instruction] = {}
        #: The variable that counts; 0: none does.
        self.counter = 0
        self._header = words[:HEADER_WORDS]
        self._next = words[3]
        self._declared: list[Instruction] = []
        self._added: list[Instruction] = []
        body: list[Instruction] | None = None
        for word in instructions:
            opcode = opcode_of(word)
            if opcode == FUNCTION:
                body = self.bodies[word[2]] = []
            if body is not None:
                body.append(word)
                continue
            self._declared.append(word)
            if opcode in range(_TYPE_VOID, 40):
                self.defined[word[1]] = word
            elif opcode in (*CONSTANTS, VARIABLE):
                self.defined[word[2]] = word
        self._types = {
            (opcode_of(word), *word[2:]): identity
            for identity, word in self.defined.items()
            if opcode_of(word) < CONSTANTS.start
        }

    def new(self) -> int:
        """Return a new id."""
        self._next += 1
        return self._next - 1

    def _type(self, opcode: int, *operands: int) -> int:
        key = (opcode, *operands)
        if key not in self._types:
            self._types[key] = self.new()
            self._added.append(instruction(opcode, self._types[key], *operands))
        return self._types[key]

    def _constant(self, opcode: int, kind: int, *value: int) -> int:
        key = (opcode, kind, *value)
        if key not in self._types:
            self._types[key] = self.new()
            self._added.append(instruction(opcode, kind, self._types[key], *value))
        return self._types[key]

    def _number(self, value: int) -> int:
        return self._constant(_CONSTANT, self._type(TYPE_INT, 32, 0), value)

    def null(self, kind: int) -> int:
        """Return a constant of zeros."""
        if opcode_of(self.defined.get(kind, (0,))) in _OPAQUE:
            raise ValueError("a loop of the SPIR-V chooses between pointers")
        return self._constant(_CONSTANT_NULL, kind)

    def count(self, function: Function, loop: set[int], head: int, end: int, weight: int) -> None:
        """Count the rounds of a loop at its end, and leave it there at the limit."""
        merge = next(
            (word[1] for word in function.blocks[head] if opcode_of(word) == LOOP_MERGE), 0
        )
        if merge not in function.blocks:
            raise ValueError("a loop of the SPIR-V has no structure")
        words = function.blocks[end]
        last = words.pop()
        merges = [words.pop()] if words and opcode_of(words[-1]) == LOOP_MERGE else []
        number, truth = self._type(TYPE_INT, 32, 0), self._type(TYPE_BOOL)
        before, after, over, kept = (self.new() for _ in range(4))
        words += [
            instruction(LOAD, number, before, self._counter_variable()),
            instruction(_ADD, number, after, before, self._number(weight)),
            instruction(_NOT_LESS, truth, over, after, self._number(self.most)),
            instruction(_SELECT, number, kept, over, self._number(self.most), after),
            instruction(STORE, self.counter, kept),
        ]
        targets = {*last[2:4]} if opcode_of(last) == BRANCH_CONDITIONAL else {last[1]}
        if targets == {head}:
            words += [*merges, instruction(BRANCH_CONDITIONAL, over, merge, head)]
        elif targets == {head, merge} and opcode_of(last) == BRANCH_CONDITIONAL:
            # The condition that leads on, or that leads out.
            made = self.new()
            if last[2] == head:
                under = self.new()
                words += [
                    instruction(_NOT, truth, under, over),
                    instruction(_AND, truth, made, last[1], under),
                ]
            else:
                words.append(instruction(_OR, truth, made, last[1], over))
            words += [*merges, (last[0], made, *last[2:])]
        else:
            raise ValueError("the end of a loop of the SPIR-V leads elsewhere")
        if merge not in function.follow[end]:
            function.follow[end] = [merge, head]
            self._add_way(function, merge, end)
            self._repair(function, loop, merge, end)

    def _counter_variable(self) -> int:
        if not self.counter:
            pointer = self._type(_TYPE_POINTER, _PRIVATE, self._type(TYPE_INT, 32, 0))
            zero = self._number(0)
            self.counter = self.new()
            self._added.append(instruction(VARIABLE, pointer, self.counter, _PRIVATE, zero))
        return self.counter

    def _add_way(self, function: Function, merge: int, end: int) -> None:
        """Give a new way to a block to its phis."""
        for index, word in enumerate(function.blocks[merge]):
            if opcode_of(word) == _PHI:
                added = (*word[1:], self.null(word[1]), end)
                function.blocks[merge][index] = instruction(_PHI, *added)

    def _repair(self, function: Function, loop: set[int], merge: int, end: int) -> None:
        """Replace values of a loop after it to which the new way out does not lead."""
        dominance = Dominance(function)
        replaced: dict[int, int] = {}
        made: list[Instruction] = []
        before = [block for block in dominance.before(merge) if block != end]

        def is_lost(identity: int, block: int) -> bool:
            home, _ = function.results.get(identity, (0, ()))
            return home in loop and not dominance.is_before(home, block)

        def replace(identity: int) -> int:
            if identity not in replaced:
                _, word = function.results[identity]
                replaced[identity] = self.new()
                if opcode_of(self.defined.get(word[1], (0,))) in _OPAQUE:
                    # The same again, as there are no phis of pointers.
                    parts = [*word]
                    parts[2] = replaced[identity]
                    for place in _ids(word):
                        if is_lost(word[place], merge) and place > 2:
                            parts[place] = replace(word[place])
                    added = tuple(parts)
                    made.append(added)
                else:
                    ways = [part for block in before for part in (identity, block)]
                    added = instruction(
                        _PHI, word[1], replaced[identity], *ways, self.null(word[1]), end
                    )
                    made.insert(0, added)
                function.results[replaced[identity]] = merge, added
            return replaced[identity]

        for block, words in function.blocks.items():
            if block in loop:
                continue
            for index, word in enumerate(words):
                changed = [*word]
                for place in _ids(word):
                    # A phi's value must be there at the end of the block from which it comes.
                    comes = opcode_of(word) == _PHI and place in range(3, len(word), 2)
                    if is_lost(word[place], word[place + 1] if comes else block):
                        changed[place] = replace(word[place])
                words[index] = tuple(changed)
        phis = sum(opcode_of(word) == _PHI for word in function.blocks[merge])
        function.blocks[merge][phis:phis] = made

    def end_all(self, function: Function, identity: int, before: set[int]) -> None:
        """End blocks that were not reached before a loop had another way out."""
        for block in Dominance(function).reached - before:
            words = function.blocks[block]
            if opcode_of(words[-1]) == UNREACHABLE:
                kind = self.bodies[identity][0][1]
                is_void = opcode_of(self.defined[kind]) == _TYPE_VOID
                words[-1] = (
                    instruction(RETURN) if is_void else instruction(RETURN_VALUE, self.null(kind))
                )

    def assemble(self) -> tuple[int, ...]:
        """Return the module; what it writes is NaN after the limit."""
        kinds = {
            word[2]: word[1]
            for body in self.bodies.values()
            for word in body
            if len(word) > 2 and word[1] in self.defined
        }
        outputs = dict(map(self._outputs, self._entries()))
        written = []
        for identity, body in self.bodies.items():
            written += body[
                : next(
                    (
                        n
                        for n, each in enumerate(body)
                        if len(each) == 2 and opcode_of(each) == LABEL
                    ),
                    len(body),
                )
            ]
            for block, words in self.functions[identity].blocks.items():
                written.append(instruction(LABEL, block))
                for word in words:
                    if opcode_of(word) == _IMAGE_WRITE:
                        value = word[3]
                        kind = kinds.get(value, self.defined.get(value, (0, 0))[1])
                        added, value = self._or_nan(kind, value)
                        written += added
                        word = (*word[:3], value, *word[4:])
                    elif opcode_of(word) == RETURN:
                        for variable in outputs.get(identity, ()):
                            written += self._spoil(variable)
                    written.append(word)
            written.append(instruction(FUNCTION_END))
        declared = self._declared
        if self._header[1] >= _ALL_LISTED:
            declared = [
                instruction(_ENTRY_POINT, *word[1:], self.counter)
                if opcode_of(word) == _ENTRY_POINT
                else word
                for word in declared
            ]
        made = [part for word in (*declared, *self._added, *written) for part in word]
        return (*self._header[:3], self._next, *self._header[4:], *made)

    def _entries(self) -> list[Instruction]:
        return [word for word in self._declared if opcode_of(word) == _ENTRY_POINT]

    def _outputs(self, entry: Instruction) -> tuple[int, list[int]]:
        """Return the function of an entry point, and what it writes if it draws."""
        end = 3
        # A text ends with the word that has a byte of zero.
        while all(entry[end] >> shift & 0xFF for shift in (0, 8, 16, 24)):
            end += 1
        located = {
            word[1]
            for word in self._declared
            if opcode_of(word) == _DECORATE and word[2] == _LOCATION
        }
        if entry[1] != _FRAGMENT:
            return entry[2], []
        return entry[2], [
            each
            for each in entry[end + 1 :]
            if each in located and self.defined[each][3] == _OUTPUT
        ]

    def _spoil(self, variable: int) -> list[Instruction]:
        """Return what makes an output NaN after the limit."""
        kind = self.defined[self.defined[variable][1]][3]
        loaded = self.new()
        added, value = self._or_nan(kind, loaded)
        if value == loaded:
            return []
        load = instruction(LOAD, kind, loaded, variable)
        return [load, *added, instruction(STORE, variable, value)]

    def _or_nan(self, kind: int, value: int) -> tuple[list[Instruction], int]:
        """Return what chooses NaN after the limit, and the result; of other types, the value."""
        declared = (*self.defined.get(kind, (0,)), 0, 0, 0)
        count = declared[3] if opcode_of(declared) == _TYPE_VECTOR else 1
        number = declared[2] if count > 1 else kind
        of = (*self.defined.get(number, (0,)), 0, 0)
        if opcode_of(of) != TYPE_FLOAT or of[2] not in _NAN:
            return [], value
        truth, rounds, over, made = self._type(TYPE_BOOL), self.new(), self.new(), self.new()
        nan = self._constant(_CONSTANT, number, _NAN[of[2]])
        added = [
            instruction(LOAD, self._type(TYPE_INT, 32, 0), rounds, self.counter),
            instruction(_NOT_LESS, truth, over, rounds, self._number(self.most)),
        ]
        if count > 1:
            nan = self._constant(_COMPOSITE, kind, *[nan] * count)
            each, over = over, self.new()
            truth = self._type(_TYPE_VECTOR, truth, count)
            added.append(instruction(_CONSTRUCT, truth, over, *[each] * count))
        return [*added, instruction(_SELECT, kind, made, over, nan, value)], made


def _ids(word: Instruction) -> Iterator[int]:
    """Yield the places of an instruction that may have ids of values."""
    literal = _LITERALS.get(opcode_of(word), len(word))
    for place in range(1, min(literal, len(word)) if literal > 0 else len(word)):
        if place != -literal:
            yield place
