"""A module of SPIR-V that counts the rounds of its loops, and writes NaN after a limit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
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
)
from vkbloom._custom.instructions import (
    CONSTANTS,
    FUNCTION_END,
    LOAD,
    STORE,
    VARIABLE,
    Instruction,
    instruction,
    opcode_of,
    split_functions,
)
from vkbloom._custom.spirv import HEADER_WORDS, PRIVATE
from vkbloom._custom.trips import TYPE_BOOL, TYPE_FLOAT, TYPE_INT

_ENTRY_POINT, _DECORATE, _TYPE_VOID, _TYPE_VECTOR, _TYPE_POINTER = 15, 71, 19, 23, 32
_CONSTANT, _COMPOSITE, _CONSTANT_NULL, _PHI, _IMAGE_WRITE = 43, 44, 46, 245, 99
_CONSTRUCT, _EXTRACT, _TO_UNSIGNED = 80, 81, 109
_ADD, _SELECT, _NOT_LESS, _BIT_AND = 128, 169, 174, 199
_INPUT, _OUTPUT, _BUILT_IN, _LOCATION, _FRAGMENT = 1, 3, 11, 30, 4
_TYPES: Final = range(19, 40)
#: Inputs that are less than 2**31 by execution model, which compilers do not know of them: vertex
#: index, coordinate of a fragment, id of an invocation; the opcode and operands of the numbers, and
#: how many they are.
_INPUTS: Final[Mapping[int, tuple[int, int, tuple[int, ...], int]]] = {
    0: (42, TYPE_INT, (32, 1), 1),
    _FRAGMENT: (15, TYPE_FLOAT, (32,), 4),
    5: (28, TYPE_INT, (32, 0), 3),
}
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


class CountedModule:
    """A module whose functions are changed, and what it declares for that."""

    def __init__(self, words: tuple[int, ...], instructions: list[Instruction], most: int) -> None:
        self.most = most
        self._declared, self.bodies = split_functions(instructions)
        self.functions: dict[int, Function] = {}
        self.defined: dict[int, Instruction] = {}
        #: The variable that counts; 0: none does.
        self.counter = 0
        self._header = words[:HEADER_WORDS]
        self._next = words[3]
        self._added: list[Instruction] = []
        self._decorations: list[Instruction] = []
        self._marks: dict[int, dict[int, int]] = {}
        for word in self._declared:
            opcode = opcode_of(word)
            if opcode == _DECORATE:
                self._marks.setdefault(word[1], {})[word[2]] = (*word, 0)[3]
            elif opcode in _TYPES:
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

    def count(
        self, function: Function, loops: Mapping[int, set[int]], head: int, weight: int
    ) -> None:
        """Count the rounds of a loop; `loops` has the loops that have it among them."""
        words = function.blocks[head]
        merge_word = (*words[-2:-1], (0, 0, 0))[0]
        _, merge, end, *hints = merge_word
        if opcode_of(merge_word) != LOOP_MERGE or merge not in function.blocks:
            raise ValueError("a loop of the SPIR-V has no structure")
        number, truth = self._type(TYPE_INT, 32, 0), self._type(TYPE_BOOL)
        inner, before, after, over = (self.new() for _ in range(4))
        start = sum(opcode_of(word) == _PHI for word in words)
        rest = [
            instruction(_ADD, number, after, before, self._number(weight)),
            instruction(STORE, self._counter_variable(), after),
            *words[start:-2],
            words[-1],
        ]
        # A loop of one block goes back from what is its rest.
        end = inner if end == head else end
        added = [
            instruction(LOAD, number, before, self.counter),
            instruction(_NOT_LESS, truth, over, before, self._number(self.most)),
            instruction(LOOP_MERGE, merge, end, *hints),
            instruction(BRANCH_CONDITIONAL, over, merge, inner),
        ]
        self._split(function, head, inner, [*words[:start], *added], rest)
        self._add_merge(function, inner, (merge, end))
        for blocks in loops.values():
            if head in blocks:
                blocks.add(inner)
        function.follow[head] = [merge, inner]
        self._add_way(function, merge, head)
        self._repair(function, loops[head], merge, head)

    def _split(
        self,
        function: Function,
        block: int,
        second: int,
        words: list[Instruction],
        rest: list[Instruction],
    ) -> None:
        """Put a second block behind a block, with the rest of it and what follows it."""
        blocks = [*function.blocks.items()]
        place = [*function.blocks].index(block)
        blocks[place : place + 1] = [(block, words), (second, rest)]
        function.blocks.clear()
        function.blocks.update(blocks)
        function.follow[second] = function.follow[block]
        for word in rest:
            if len(word) > 2 and function.results.get(word[2], (0, ()))[1] == word:
                function.results[word[2]] = second, word
        for each in {*function.follow[second]}:
            function.blocks[each] = [
                instruction(
                    _PHI,
                    *word[1:3],
                    *(
                        second if place % 2 and part == block else part
                        for place, part in enumerate(word[3:])
                    ),
                )
                if opcode_of(word) == _PHI
                else word
                for word in function.blocks[each]
            ]

    def _add_merge(self, function: Function, block: int, exits: tuple[int, int]) -> None:
        """Let a block that began a loop say where two ways meet between which it chooses.

        It need not where one of them leaves the round.
        """
        words = function.blocks[block]
        if len({*function.follow[block]} - {*exits}) < 2:
            return
        # If they meet, then where the round ends: no block comes after both.
        never = self.new()
        words.insert(-1, instruction(SELECTION_MERGE, never, 0))
        function.blocks[never] = [instruction(UNREACHABLE)]
        function.follow[never] = []

    def _counter_variable(self) -> int:
        if not self.counter:
            pointer = self._type(_TYPE_POINTER, PRIVATE, self._type(TYPE_INT, 32, 0))
            self.counter = self.new()
            self._added.append(instruction(VARIABLE, pointer, self.counter, PRIVATE))
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
        outputs: dict[int, list[int]] = {}
        declared = []
        for word in self._declared:
            if opcode_of(word) == _ENTRY_POINT:
                variables = self._interface(word)
                if word[1] == _FRAGMENT:
                    outputs[word[2]] = [each for each in variables if self._is_output(each)]
                used = self._begin(word[2], word[1], variables)
                added = (used, self.counter) if self._header[1] >= _ALL_LISTED else (used,)
                new = (each for each in added if each not in variables)
                declared.append(instruction(_ENTRY_POINT, *word[1:], *new))
            else:
                declared.append(word)
        written = [
            each
            for identity in self.bodies
            for word in self._function(identity)
            for each in self._or_spoilt(word, kinds, outputs.get(identity, ()))
        ]
        # Decorations come before all types.
        first = next(n for n, word in enumerate(declared) if opcode_of(word) in _TYPES)
        declared[first:first] = self._decorations
        made = [part for word in (*declared, *self._added, *written) for part in word]
        return (*self._header[:3], self._next, *self._header[4:], *made)

    def _function(self, identity: int) -> Iterator[Instruction]:
        """Yield the instructions of a function."""
        for word in self.bodies[identity]:
            if opcode_of(word) == LABEL:
                break
            yield word
        if self.functions[identity].blocks:
            for block, words in self.functions[identity].blocks.items():
                yield instruction(LABEL, block)
                yield from words
            yield instruction(FUNCTION_END)

    def _or_spoilt(
        self, word: Instruction, kinds: Mapping[int, int], outputs: Iterable[int]
    ) -> Iterator[Instruction]:
        """Yield an instruction; what it writes, or the outputs that it leaves, may become NaN."""
        if opcode_of(word) == _IMAGE_WRITE:
            value = word[3]
            kind = kinds.get(value, self.defined.get(value, (0, 0))[1])
            added, value = self._or_nan(kind, value)
            yield from added
            yield (*word[:3], value, *word[4:])
            return
        if opcode_of(word) == RETURN:
            for variable in outputs:
                yield from self._spoil(variable)
        yield word

    def _interface(self, entry: Instruction) -> Instruction:
        """Return the variables of an entry point."""
        end = 3
        # A text ends with the word that has a byte of zero.
        while all(entry[end] >> shift & 0xFF for shift in (0, 8, 16, 24)):
            end += 1
        return entry[end + 1 :]

    def _is_output(self, variable: int) -> bool:
        storage = self.defined[variable][3]
        return storage == _OUTPUT and _LOCATION in self._marks.get(variable, {})

    def _begin(self, identity: int, model: int, variables: Instruction) -> int:
        """Set the counter to 0 where an entry point begins; return the input of which it is made.

        A compiler that knows the counter may run a loop: Mesa's would, round after round, until
        the limit.
        """
        if model not in _INPUTS:
            raise ValueError("the SPIR-V has an entry point of an unknown stage")
        mark, opcode, operands, count = _INPUTS[model]
        used = next(
            (each for each in variables if self._marks.get(each, {}).get(_BUILT_IN) == mark), 0
        )
        if not used:
            kind = self._type(opcode, *operands)
            kind = kind if count == 1 else self._type(_TYPE_VECTOR, kind, count)
            used = self.new()
            pointer = self._type(_TYPE_POINTER, _INPUT, kind)
            self._added.append(instruction(VARIABLE, pointer, used, _INPUT))
            self._decorations.append(instruction(_DECORATE, used, _BUILT_IN, mark))
        else:
            kind = self.defined[self.defined[used][1]][3]
        number, sign = self._type(TYPE_INT, 32, 0), self._number(1 << 31)
        part = self._type(opcode, *operands)
        loaded, zero = self.new(), self.new()
        added = [instruction(LOAD, kind, loaded, used)]
        last = loaded
        if count > 1:
            last = self.new()
            added.append(instruction(_EXTRACT, part, last, loaded, 0))
        if opcode == TYPE_FLOAT:
            whole = self.new()
            added.append(instruction(_TO_UNSIGNED, number, whole, last))
            last = whole
        added.append(instruction(_BIT_AND, number, zero, last, sign))
        added.append(instruction(STORE, self.counter, zero))
        words = next(iter(self.functions[identity].blocks.values()))
        place = sum(opcode_of(word) == VARIABLE for word in words)
        words[place:place] = added
        return used

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
