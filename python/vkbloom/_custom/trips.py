"""How often loops of SPIR-V run that count between constants: what decides it is run."""

from __future__ import annotations

import ctypes
import math
import operator
from collections.abc import Callable, Mapping
from typing import Final

from vkbloom._custom.flow import BRANCH_CONDITIONAL, Dominance, Function
from vkbloom._custom.instructions import LOAD, STORE, VARIABLE, Instruction, opcode_of

Number = int | float
TYPE_BOOL, TYPE_INT, TYPE_FLOAT = 20, 21, 22
_CONSTANT, _TRUE, _FALSE, _PHI = 43, 41, 42, 245
#: Less is flushed to 0 by some devices.
_MIN_FLOAT: Final = 2.0**-126
#: Of the instructions that are run for a function.
_MAX_STEPS: Final = 1 << 18


class _NotKnownError(Exception):
    """What a loop does is not known, or is not the same on all devices."""


def _signed(value: int) -> int:
    return value - (value >> 31 << 32)


def _divide(first: int, second: int) -> int:
    if second == 0:
        raise _NotKnownError
    return abs(first) // abs(second) * (1 if (first < 0) == (second < 0) else -1)


def _shift(by: Callable[[int, int], int]) -> Callable[[int, int], int]:
    def shift(value: int, count: int) -> int:
        if count > 31:
            raise _NotKnownError
        return by(value, count)

    return shift


def _truncate(least: int, end: int) -> Callable[[float], int]:
    def truncate(value: float) -> int:
        if not least <= value < end:
            raise _NotKnownError
        return math.trunc(value)

    return truncate


#: Of integers as their words, of integers with a sign, and of floats.
_OF_WORDS: Final[Mapping[int, Callable[..., Number]]] = {
    83: lambda a: a,  # OpCopyObject
    112: float,  # OpConvertUToF
    128: operator.add,
    130: operator.sub,
    132: operator.mul,
    134: _divide,
    164: operator.eq,  # OpLogicalEqual
    165: operator.ne,
    166: operator.or_,
    167: operator.and_,
    168: lambda a: not a,
    169: lambda a, b, c: b if a else c,
    170: operator.eq,
    171: operator.ne,
    172: operator.gt,
    174: operator.ge,
    176: operator.lt,
    178: operator.le,
    194: _shift(operator.rshift),
    196: _shift(operator.lshift),
    197: operator.or_,
    198: operator.xor,
    199: operator.and_,
    200: operator.invert,
}
_OF_SIGNED: Final[Mapping[int, Callable[..., Number]]] = {
    111: float,  # OpConvertSToF
    126: operator.neg,
    135: _divide,
    173: operator.gt,
    175: operator.ge,
    177: operator.lt,
    179: operator.le,
}
_OF_FLOATS: Final[Mapping[int, Callable[..., Number]]] = {
    109: _truncate(0, 2**32),  # OpConvertFToU
    110: _truncate(-(2**31), 2**31),  # OpConvertFToS
    127: operator.neg,
    129: operator.add,
    131: operator.sub,
    133: operator.mul,
    **dict.fromkeys((180, 181), operator.eq),
    **dict.fromkeys((182, 183), operator.ne),
    **dict.fromkeys((184, 185), operator.lt),
    **dict.fromkeys((186, 187), operator.gt),
    **dict.fromkeys((188, 189), operator.le),
    **dict.fromkeys((190, 191), operator.ge),
}
#: The right shift that keeps the sign: its count has none.
_ARITHMETIC_SHIFT: Final = 195


class Trips:
    """Counts the rounds of loops of a function, with a bound of what that may take."""

    def __init__(
        self,
        defined: Mapping[int, Instruction],
        function: Function,
        dominance: Dominance,
        loops: Mapping[int, set[int]],
    ) -> None:
        self._defined = defined
        self._function = function
        self._dominance = dominance
        self._loops = loops
        self._steps = _MAX_STEPS
        #: Instructions with each variable of the function, and their blocks.
        self._uses: dict[int, list[tuple[int, Instruction]]] = {}
        for block, words in function.blocks.items():
            for word in words:
                for each in word[1:]:
                    if opcode_of(function.results.get(each, (0, (0,)))[1]) == VARIABLE:
                        self._uses.setdefault(each, []).append((block, word))

    def count(self, head: int, end: int, most: int) -> int | None:
        """Return how often a loop begins a round; None: it is not known, or more than `most`.

        `end`: The block from which it goes back to its head.
        """
        loop = self._loops[head]
        inner = {
            block
            for each, blocks in self._loops.items()
            if each in loop - {head}
            for block in blocks
        }
        # Blocks that each round runs just once, in their order.
        chain = [
            block
            for block in self._function.blocks
            if block in loop - inner and self._dominance.is_before(block, end)
        ]
        counts = []
        for block in chain:
            last = self._function.blocks[block][-1]
            if opcode_of(last) != BRANCH_CONDITIONAL:
                continue
            leaves = [target not in loop for target in last[2:4]]
            if leaves[0] != leaves[1]:
                try:
                    counts.append(
                        _Rounds(self, head, end, chain).run(block, last[1], leaves[0], most)
                    )
                except _NotKnownError:
                    continue
        return min(counts, default=None)


class _Rounds:
    """Runs the rounds of a loop, but only what decides whether one of its exits is taken."""

    def __init__(self, trips: Trips, head: int, end: int, chain: list[int]) -> None:
        self._trips = trips
        self._defined, self._function = trips._defined, trips._function
        self._head, self._end, self._chain = head, end, chain
        self._loop = trips._loops[head]
        self._values: dict[int, Number] = {}
        self._variables: dict[int, Number] = {}
        self._phis: dict[int, int] = {}
        self._steps: set[Instruction] = set()
        self._waiting: list[int] = []

    def run(self, exit: int, condition: int, leaves: bool, most: int) -> int:
        """Return the round in which the exit of a block is taken: its condition is `leaves`."""
        self._waiting.append(condition)
        for identity in self._waiting:
            self._find(identity)
        steps = []
        for block in self._chain:
            steps += [word for word in self._function.blocks[block] if word in self._steps]
            if block == exit:
                steps.append(())
        for number in range(1, most + 1):
            self._trips._steps -= len(steps)
            if self._trips._steps < 0:
                break
            for word in steps:
                if not word:
                    if bool(self._values[condition]) == leaves:
                        return number
                    continue
                self._step(word)
            self._values.update({key: self._values[each] for key, each in self._phis.items()})
        raise _NotKnownError

    def _step(self, word: Instruction) -> None:
        opcode = opcode_of(word)
        if opcode == STORE:
            self._variables[word[1]] = self._values[word[2]]
        elif opcode == LOAD:
            self._values[word[2]] = self._variables[word[3]]
        else:
            kind = self._kind(word[1])
            self._values[word[2]] = _in_range(kind, self._evaluate(opcode, word[3:]))

    def _evaluate(self, opcode: int, operands: Instruction) -> Number:
        values = [self._values[each] for each in operands]
        if opcode in _OF_WORDS:
            return _OF_WORDS[opcode](*values)
        if opcode in _OF_SIGNED:
            return _OF_SIGNED[opcode](*(_signed(int(each)) for each in values))
        if opcode in _OF_FLOATS:
            return _OF_FLOATS[opcode](*values)
        if opcode == _ARITHMETIC_SHIFT:
            return _shift(operator.rshift)(_signed(int(values[0])), int(values[1]))
        raise _NotKnownError

    def _kind(self, identity: int) -> int:
        """Return the opcode of a type of a number of 32 bits, or of bool."""
        word = (*self._defined.get(identity, (0,)), 0, 0)
        kind = opcode_of(word)
        if kind != TYPE_BOOL and (kind not in (TYPE_INT, TYPE_FLOAT) or word[2] != 32):
            raise _NotKnownError
        return kind

    def _find(self, identity: int) -> None:
        """Find how a value is computed in each round."""
        if identity in self._values or identity in self._phis:
            return
        if identity in self._defined:
            self._values[identity] = self._constant(identity)
            return
        block, word = self._function.results.get(identity, (0, (0,)))
        opcode = opcode_of(word)
        if word in self._steps:
            return
        if block not in self._chain:
            raise _NotKnownError
        self._kind(word[1])
        if opcode == _PHI and block == self._head:
            self._find_phi(word)
        elif opcode == LOAD:
            self._steps.add(word)
            self._find_variable(word[3])
        elif (
            opcode in _OF_WORDS
            or opcode in _OF_SIGNED
            or opcode in _OF_FLOATS
            or opcode == _ARITHMETIC_SHIFT
        ):
            self._steps.add(word)
            self._waiting += word[3:]
        else:
            raise _NotKnownError

    def _find_phi(self, word: Instruction) -> None:
        pairs = dict(zip(word[4::2], word[3::2], strict=False))
        after = pairs.pop(self._end, 0)
        if len({*pairs.values()}) != 1 or not after:
            raise _NotKnownError
        self._values[word[2]] = self._constant(next(iter(pairs.values())))
        self._phis[word[2]] = after
        self._waiting.append(after)

    def _find_variable(self, variable: int) -> None:
        """Find what a variable is before the loop, and what a round makes of it."""
        if variable in self._variables:
            return
        _, declared = self._function.results.get(variable, (0, (0,)))
        uses = self._trips._uses.get(variable, [])
        stores = [
            (block, word)
            for block, word in uses
            if opcode_of(word) == STORE and word[2] != variable
        ]
        loads = [word for _, word in uses if opcode_of(word) == LOAD]
        if opcode_of(declared) != VARIABLE or len(stores) + len(loads) + 1 < len(uses):
            raise _NotKnownError
        before = [each for each in stores if each[0] not in self._loop]
        within = [each for each in stores if each[0] in self._loop]
        if len(within) > 1 or any(block not in self._chain for block, _ in within):
            raise _NotKnownError
        self._variables[variable] = self._constant(self._first_value(declared, before))
        for _, word in within:
            self._steps.add(word)
            self._waiting.append(word[2])

    def _first_value(self, declared: Instruction, before: list[tuple[int, Instruction]]) -> int:
        """Return what a variable is whenever the loop begins."""
        around = [
            loop
            for loop in self._trips._loops.values()
            if self._head in loop and loop is not self._loop
        ]
        if not before and not around and len(declared) > 4:
            return declared[4]
        if len(before) == 1:
            block, word = before[0]
            if self._trips._dominance.is_before(block, self._head) and all(
                block in loop for loop in around
            ):
                return word[2]
        raise _NotKnownError

    def _constant(self, identity: int) -> Number:
        word = self._defined.get(identity, (0,))
        opcode = opcode_of(word)
        if opcode in (_TRUE, _FALSE):
            return opcode == _TRUE
        if opcode != _CONSTANT:
            raise _NotKnownError
        kind = self._kind(word[1])
        if kind == TYPE_FLOAT:
            return _in_range(kind, ctypes.c_float.from_buffer(ctypes.c_uint32(word[3])).value)
        return word[3]


def _in_range(kind: int, value: Number) -> Number:
    """Return a result as a number of its type."""
    if kind == TYPE_BOOL:
        return bool(value)
    if kind == TYPE_INT:
        return int(value) & 0xFFFFFFFF
    made = ctypes.c_float(value).value
    if not math.isfinite(made) or 0 < abs(made) < _MIN_FLOAT:
        raise _NotKnownError
    return made
